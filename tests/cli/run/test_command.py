"""Tests of `cellwright run`: outcomes, exit statuses, output, pictures."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from cellwright.running.run import observers
from tests.cli.conftest import CommandLine
from tests.rendering.test_png import decode
from tests.support.quick_children import QUICK_DRAWING

UNTIL = ("--agent", "none", "--until", "0.1", "--no-picture")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("agent", "more", "status", "outcome"),
    [
        ("Ends", (), 0, "done"),
        ("ExitsWell", (), 0, "done"),
        ("Ends", ("--min-score", "0"), 0, "done"),
        ("Ends", ("--min-score", "1"), 1, "done"),
        ("GivesUp", (), 1, "gave_up"),
        ("Crashes", (), 1, "crashed"),
        ("Exits", (), 1, "crashed"),
        ("Waits", ("--until", "0.2"), 1, "until"),
        ("none", ("--until", "0.2"), 0, "until"),
    ],
)
def test_exit_status_follows_outcome_and_min_score(
    agent: str, more: tuple[str, ...], status: int, outcome: str, cellwright: CommandLine, agents: str
) -> None:
    name = agent if agent == "none" else f"{agents}:{agent}"
    ran = cellwright("run", "lesson", "--agent", name, "--no-picture", "--json", *more)
    document = json.loads(ran.out)  # whatever the agent prints
    assert (ran.status, document["exit_status"], document["outcome"]) == (status, status, outcome)


def test_time_limit_ends_run_with_status_1(cellwright: CommandLine, agents: str, tmp_path: Path) -> None:
    lesson = "options: {insert_agvs: true}\ntime_limit: 0.2\norders: {order_0: {announcement_condition: time, "
    (tmp_path / "short.yaml").write_text(
        lesson + "announcement_condition_value: 0, parts: {part_0: {type: gear_part, pose: {}}}}}\n"
    )
    ran = cellwright("run", "short.yaml", "--agent", f"{agents}:Waits", "--no-picture")
    assert ran.status == 1
    assert "outcome     time limit\n" in ran.out


def test_set_replaces_a_value_of_the_file(cellwright: CommandLine, agents: str) -> None:
    options = ("--agent", f"{agents}:Waits", "--set", "time_limit=0.2", "--set", "cellwright.seed=5")
    ran = cellwright("run", "lesson", *options, "--no-picture")
    assert ran.status == 1
    assert f"trial lesson, time_limit=0.2, cellwright.seed=5, agent {agents}:Waits, seed 5" in ran.out
    assert "outcome     time limit\n" in ran.out


@pytest.mark.parametrize(
    ("value", "error"),
    [
        (
            "options.fill_demo_trai=true",
            "--set: options.fill_demo_trai: unknown option, ignored; did you mean fill_demo_tray",
        ),
        ("time_limit", "--set: must be KEY=VALUE (got 'time_limit'); write it as in time_limit=60"),
    ],
)
def test_set_of_an_ignored_value_is_refused(value: str, error: str, cellwright: CommandLine) -> None:
    for command in (("run", "lesson", *UNTIL), ("serve", "lesson"), ("check", "lesson")):
        ran = cellwright(*command, "--set", value)
        assert ran.status == 2
        assert f"error: {error}\n" in ran.out + ran.err


def test_agent_crash_prints_traceback_of_agent_only(cellwright: CommandLine, agents: str) -> None:
    ran = cellwright("run", "lesson", "--agent", f"{agents}:Crashes", "--no-picture")
    assert "agents.py" in ran.err
    assert ran.err.endswith("ValueError: no idea\n")
    assert "cellwright/run.py" not in ran.err
    assert "outcome     the agent crashed\n" in ran.out
    assert "the agent exited with 3" in cellwright("run", "lesson", "--agent", f"{agents}:Exits", "--no-picture").err


def test_summary_contains_usual_facts(cellwright: CommandLine, agents: str) -> None:
    ran = cellwright("run", "lesson", "--agent", f"{agents}:Ends", "--no-picture", "--seed", "7", "--min-score", "1")
    assert ran.err == ""
    for pattern in (
        r"^trial lesson, agent agents\.py:Ends, seed 7, servo original$",
        r"^    0\.004 s  announcing order_0 \(time\): order_0_kit_0$",
        r"^order_0, kit order_0_kit_0: not submitted, no points$",
        r"^outcome     done$",
        r"^score       0 of 12 points$",
        r"^not enough  below --min-score 1$",
        r"^simulated   \d+\.\d s in \d+\.\d s: \d+\.\d x real time$",
        r"^state hash  [0-9a-f]{64}$",
        r"^versions    cellwright \S+, mujoco \S+, numpy \S+$",
        r"^            python \S+, platform \S+ \S+$",
    ):
        assert re.search(pattern, ran.out, re.MULTILINE), pattern


def test_output_without_terminal_has_no_control_characters(cellwright: CommandLine, agents: str) -> None:
    ran = cellwright("run", "lesson", "--agent", f"{agents}:Ends", "--no-picture", "--verbose")
    assert all(character == "\n" or character.isprintable() for character in ran.out + ran.err)
    assert max(map(len, ran.out.splitlines())) <= 80


def test_json_is_the_only_output_on_stdout(cellwright: CommandLine, agents: str) -> None:
    ran = cellwright("run", "lesson", "--agent", f"{agents}:Ends", "--no-picture", "--json", "--listen", "/clock")
    document = json.loads(ran.out)
    assert "something that the agent prints" in ran.err
    assert "announcing order_0" in ran.err
    assert {"trial", "seed", "servo", "score", "state_hash", "real_time_factor", "versions", "timestep"} <= set(
        document
    )
    assert document["heard"] == {"/clock": document["steps"]}
    assert document["score"]["best"] == 12.0
    assert document["score"]["orders"][0]["kits"][0]["submitted"] is False
    assert set(document["versions"]) == {"cellwright", "mujoco", "numpy", "python", "platform"}


@pytest.mark.slow
@pytest.mark.usefixtures("small_pictures")
def test_listening_does_not_change_state_hash(cellwright: CommandLine, agents: str) -> None:
    def state_hash(*more: str) -> str:
        ran = cellwright("run", "lesson", "--agent", f"{agents}:Ends", "--no-picture", "--json", *more)
        return str(json.loads(ran.out)["state_hash"])

    plain = state_hash()
    assert plain == state_hash("--listen", "all", "--speed", "1000", "--snapshot", "0.1:a.png", "--camera", "agv2")
    assert plain != state_hash("--servo", "precise")


@pytest.mark.usefixtures("small_pictures")
def test_snapshots_and_final_picture_are_written(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright(
        "run", "lesson", "--agent", "none", "--until", "0.2", "--snapshot", "0.1:a.PNG", "--snapshot", "0:b.png"
    )
    assert ran.status == 0
    assert ran.out.splitlines()[-3:] == ["picture     b.png", "picture     a.PNG", "picture     lesson.png"]
    for name in ("a.PNG", "b.png", "lesson.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


@QUICK_DRAWING
@pytest.mark.slow
def test_fast_pictures_do_not_change_state_hash(cellwright: CommandLine, tmp_path: Path) -> None:
    options = ("run", "lesson", "--agent", "none", "--until", "0.2", "--no-picture", "--quality", "fast", "--json")
    ran = cellwright(*options, "--snapshot", "0.1:a.png", "--camera", "bins")
    result = json.loads(ran.out)
    assert (ran.status, result["pictures"]) == (0, ["a.png"])
    assert decode((tmp_path / "a.png").read_bytes()).shape == (720, 1280, 3)
    assert result["state_hash"] == json.loads(cellwright(*options).out)["state_hash"]


@QUICK_DRAWING
@pytest.mark.slow
@pytest.mark.parametrize(("backend", "size"), [("egl", (720, 1280, 3)), ("rays", (36, 64, 3))])
def test_picture_at_end_is_drawn_by_opengl_where_there_is_one(
    backend: str, size: tuple[int, ...], cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(observers, "render", lambda *_, **__: np.zeros((36, 64, 3), np.uint8))
    monkeypatch.setenv("CELLWRIGHT_RENDERING", backend)
    assert cellwright("run", "lesson", "--agent", "none", "--until", "0.1").status == 0
    assert decode(Path("lesson.png").read_bytes()).shape == size


def test_missed_snapshot_exits_with_1_and_warning(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "late.png").write_bytes(b"of an earlier run")
    ran = cellwright("run", "lesson", *UNTIL, "--snapshot", "5:late.png", "--json")
    assert ran.status == 1
    assert "warning: late.png: picture not taken; the run ended at 0.1 s, before 5 s\n" in ran.err
    assert json.loads(ran.out)["pictures"] == []


@pytest.mark.usefixtures("small_pictures")
def test_full_disk_loses_picture_and_keeps_run(
    cellwright: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cellwright.rendering.picture.write_atomic", full)
    ran = cellwright("run", "lesson", "--agent", "none", "--until", "0.1")
    assert ran.status == 0
    assert "state hash" in ran.out
    assert ran.err == "warning: cannot write the picture lesson.png: No space left on device\n"
    ran = cellwright("run", "lesson", *UNTIL, "--snapshot", "0.05:a.png")
    assert ran.status == 1
    assert ran.err == "warning: cannot write the picture a.png: No space left on device\n"


def test_resumed_run_has_state_hash_of_whole_run(cellwright: CommandLine) -> None:
    def state_hash(*more: str) -> str:
        ran = cellwright("run", "lesson", "--agent", "none", "--until", "1", "--no-picture", "--json", *more)
        return str(json.loads(ran.out)["state_hash"])

    assert state_hash("--checkpoint", "0.5:half.npz") == state_hash("--resume", "half.npz")


def test_unknown_option_of_file_is_a_warning(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("options:\n  insert_agv: true\n")
    ran = cellwright("run", "a.yaml", *UNTIL)
    assert ran.status == 0
    message = "a.yaml:2: options.insert_agv: unknown option, ignored; did you mean insert_agvs"
    assert ran.err == f"warning: {message}\n"
    assert cellwright("check", "a.yaml").out == f"warning: {message}\nok\n"
    document = json.loads(cellwright("check", "a.yaml", "--json").out)
    assert (document["ok"], document["errors"], document["warnings"]) == (True, [], [message])
