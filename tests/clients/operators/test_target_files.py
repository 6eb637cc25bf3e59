"""Target files: accepted ones, and refusals with their line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.operators import playback
from cellwright.clients.operators.playback import TargetSample, read_targets
from cellwright.clients.operators.robot import GRIPPER_COMMAND, JOINT_COMMAND
from cellwright.util.errors import CellwrightError, DescriptionError, UsageError

NUMBERS = st.floats(-1e3, 1e3)


def written(folder: Path, text: str, name: str = "motion.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8", newline="")
    return path


def test_csv_file_is_read_as_target_samples(tmp_path: Path) -> None:
    text = "\ufefftime, head , elbow\r\n0.0,0.1,\r\n\r\n0.5,,1e-1\r\n0.5, 0.2,-3\r\n"
    targets = read_targets(written(tmp_path, text))
    assert targets.samples == (
        TargetSample(0.0, JOINT_COMMAND, {"head": 0.1}),
        TargetSample(0.5, JOINT_COMMAND, {"elbow": 0.1}),
        TargetSample(0.5, JOINT_COMMAND, {"head": 0.2, "elbow": -3.0}),
    )
    assert targets.duration == 0.5
    assert targets.first == {"head": 0.1, "elbow": 0.1}
    reach = {name: (min(values), max(values)) for name, values in targets.positions.items()}
    assert reach == {"head": (0.1, 0.2), "elbow": (-3.0, 0.1)}


def test_jsonl_file_is_read_with_gripper_targets(tmp_path: Path) -> None:
    lines = [
        {"time": 1, "positions": {"head": 0.1}},
        {"time": 2.5, "positions": {"gripper_left": 1, "gripper_right": 0}},
    ]
    targets = read_targets(written(tmp_path, "\n\n".join(map(json.dumps, lines)), "motion.jsonl"))
    assert targets.samples == (
        TargetSample(1.0, JOINT_COMMAND, {"head": 0.1}),
        TargetSample(2.5, GRIPPER_COMMAND, {"gripper_right": 0.0, "gripper_left": 1.0}),
    )
    assert list(targets.samples[1].values) == ["gripper_right", "gripper_left"]
    assert targets.first == {"head": 0.1}


def test_row_with_joints_and_gripper_gives_two_messages(tmp_path: Path) -> None:
    targets = read_targets(written(tmp_path, "time,head,gripper_right\n0,0.1,0.5\n"))
    assert [sample.topic for sample in targets.samples] == [JOINT_COMMAND, GRIPPER_COMMAND]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "motion.csv:1: the first line must be `time` and joint names"),
        ("head,time\n", ":1: the first line must be `time`"),
        ("time\n0\n", ":1: the first line must name a joint"),
        ("time,,head\n", ":1: the first line must name a joint"),
        ("time,head,head\n", ":1: named twice: head"),
        ("time,head\n", "motion.csv: it holds no targets"),
        ("time,head\n0,1,2\n", ":2: needs 2 fields as in the first line (got 3)"),
        ("time,head\n0,x\n", ":2: head: must be a number (got 'x')"),
        ("time,head\n,1\n", ":2: time: must be a number (got '')"),
        ("time,head\n0,nan\n", ":2: head: must be finite (got nan)"),
        ("time,head\ninf,0\n", ":2: time: must be finite (got inf)"),
        ("time,head\n1,0\n0.5,0\n", ":3: time: must not decrease (got 0.5 after 1)"),
        ("time,gripper_right\n0,1.5\n", ":2: gripper_right: must be from 0 (open) to 1 (closed) (got 1.5)"),
        ("time,gripper_left\n0,1\n", ":2: gripper_left: needs gripper_right as well"),
    ],
)
def test_bad_csv_file_is_refused_with_line(text: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(DescriptionError) as caught:
        read_targets(written(tmp_path, text))
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("{", "is not JSON: Expecting property name"),
        ("[1]", 'must be an object with "time" and "positions"'),
        ('{"time": 0}', "must be an object"),
        ('{"time": true, "positions": {}}', "time: must be a number (got True)"),
        ('{"time": "0", "positions": {}}', "time: must be a number (got '0')"),
        ('{"time": 0, "positions": [1]}', "positions: must be an object"),
        ('{"time": 0, "positions": {"head": null}}', "positions: head: must be a number (got None)"),
        ('{"time": 0, "positions": {"head": NaN}}', "positions: head: must be a number (got nan)"),
        ('{"time": 0, "positions": {"head": 1e999}}', "positions: head: must be a number (got inf)"),
        ('{"time": 0, "positions": {"head": ' + 5000 * "9" + "}}", "a number is too long"),
        (20000 * "[", "nested too deeply"),
    ],
)
def test_bad_jsonl_line_is_refused_with_line(line: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(DescriptionError) as caught:
        read_targets(written(tmp_path, f'{{"time": 0, "positions": {{"head": 0}}}}\n{line}\n', "motion.jsonl"))
    assert f"motion.jsonl:2: {reason}" in str(caught.value) or reason in str(caught.value)


def test_at_most_ten_problems_of_file_are_reported(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError) as caught:
        read_targets(written(tmp_path, "time,head\n" + 1000 * "0,x\n"))
    assert len(caught.value.problems) == 10


@pytest.mark.parametrize("name", ["motion.txt", "motion", "motion.yaml"])
def test_unknown_file_suffix_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"give a file that ends in \.csv, \.jsonl or \.bag"):
        read_targets(written(tmp_path, "", name))


def test_unreadable_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be read: No such file"):
        read_targets(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"time,\xff\n")
    with pytest.raises(UsageError, match="is not text in UTF-8"):
        read_targets(tmp_path / "bytes.csv")


@pytest.mark.slow
@given(rows=st.lists(st.tuples(st.floats(0.0, 1e4), NUMBERS, NUMBERS), min_size=1, max_size=20))
def test_csv_and_jsonl_files_read_back_same_rows(
    rows: list[tuple[float, float, float]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder, rows = tmp_path_factory.mktemp("files"), sorted(rows)
    table = "time,a,b\n" + "".join(f"{time!r},{a!r},{b!r}\n" for time, a, b in rows)
    lines = "\n".join(json.dumps({"time": time, "positions": {"a": a, "b": b}}) for time, a, b in rows)
    of_csv = read_targets(written(folder, table)).samples
    assert of_csv == read_targets(written(folder, lines, "motion.jsonl")).samples
    assert [(sample.time, *sample.values.values()) for sample in of_csv] == rows


@pytest.mark.slow
@given(text=st.text(alphabet='time,ab01.5-e"\n{}: \x00\u2028', max_size=80), name=st.sampled_from(["m.csv", "m.jsonl"]))
def test_any_file_content_is_read_or_refused(text: str, name: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = written(tmp_path_factory.getbasetemp(), text, name)
    reason = ""
    try:
        assert read_targets(path).samples
    except CellwrightError as error:
        reason = str(error)
    assert not reason or str(path) in reason


def test_control_bytes_in_joint_name_are_escaped(tmp_path: Path) -> None:
    path = tmp_path / "targets.csv"
    path.write_text("time,a\x1b[2J\n0,x\n")
    with pytest.raises(DescriptionError) as raised:
        read_targets(path)
    assert str(raised.value) == f"{path}:2: a\\x1b[2J: must be a number (got 'x')"


def test_endless_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(playback, "MAX_FILE_SIZE", 1 << 20)
    path = tmp_path / "targets.csv"
    path.symlink_to("/dev/zero")
    with pytest.raises(UsageError, match="must be at most 1 MiB"):
        read_targets(path)
