"""Tests of the whole launcher; tests/ros1/test_gear.py checks against ROS itself that it starts the cell."""

from pathlib import Path

import pytest
import yaml

from cellwright.cli.launchers.gear import launcher
from cellwright.cli.launchers.gear.launcher import main
from cellwright.cli.options import SPEED
from cellwright.config.trial.catalogue import find_trial
from cellwright.running.run import Session

SAMPLE = str(find_trial("sample"))


@pytest.fixture(autouse=True)
def at_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)


def test_dry_run_prints_files_and_writes_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["-n", "-d", "-f", SAMPLE, "-o", str(tmp_path / "out")], {}) == 0
    out, err = capsys.readouterr()
    assert err == ""
    names = [line.removeprefix("# file: ") for line in out.splitlines() if line.startswith("# file: ")]
    assert names == ["config.yaml", "gear.yaml", "gear.urdf", "gear.launch"]
    assert Path(SAMPLE).read_text().rstrip() in out
    assert 'args="--development-mode -f $(dirname)/config.yaml"' in out
    assert list(tmp_path.iterdir()) == []


def test_several_files_are_joined(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.yaml").write_text("time_limit: 5\nsensors:\n")
    (tmp_path / "b.yaml").write_text("  beam:\n    type: break_beam\n    pose: {xyz: [1, 2, 1]}\n")
    assert main(["-n", "-f", "a.yaml", "b.yaml"], {}) == 0
    out, _ = capsys.readouterr()
    resolved = out.split("# file: gear.yaml\n")[1].split("# file: ")[0]
    assert yaml.safe_load(resolved)["sensors"]["beam"]["type"] == "break_beam"


def test_empty_configuration_starts_cell(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["-n"], {}) == 0
    assert "arm: false\nsensors: {}\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (["foo: 1\nbar: 2"], ["<text>:1: foo: unknown top-level entry", "<text>:2: bar: unknown top-level entry"]),
        (["-f", "nowhere.yaml"], ["nowhere.yaml: cannot be read: No such file or directory"]),
        (["a: ["], ["<text>:1: invalid YAML"]),
    ],
)
def test_errors_are_printed_per_line_with_status_1(
    given: list[str], expected: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(given, {}) == 1
    out, err = capsys.readouterr()
    assert out == ""
    lines = err.splitlines()
    assert len(lines) == len(expected)
    for line, text in zip(lines, expected, strict=True):
        assert line.startswith(f"Error: {text}")


def test_warnings_do_not_end_launcher(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["-n", "arm: {type: ur10, colour: red}"], {}) == 0
    out, err = capsys.readouterr()
    assert err.startswith("Warning: <text>:1: arm.colour: ")
    assert "# file: gear.launch" in out


def test_missing_ros_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It writes everything, then it cannot start the cell: status 1, and one line."""
    monkeypatch.setenv("CELLWRIGHT_ROS1_PYTHON", str(tmp_path / "no-python"))
    assert main(["-o", "out"], {}) == 1
    err = capsys.readouterr().err
    assert err.startswith("Error: ")
    assert len(err.splitlines()) == 1
    assert (tmp_path / "out" / "gear.launch").is_file()


def test_unwritable_output_folder_is_a_warning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("CELLWRIGHT_ROS1_PYTHON", str(tmp_path / "no-python"))
    (tmp_path / "out").touch()
    assert main(["-o", "out"], {}) == 1
    warning, error = capsys.readouterr().err.splitlines()
    assert warning.startswith("Warning: out: cannot be written: ")
    assert error.startswith("Error: ")


@pytest.mark.parametrize(("variables", "speed"), [({}, 1.0), ({SPEED: "2.5"}, 2.5), ({SPEED: "max"}, None)])
def test_speed_is_read_from_environment(
    variables: dict[str, str], speed: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    served: list[float | None] = []

    def serve(session: Session, _console: object, *, verbose: bool) -> int:
        assert not verbose
        served.append(session.rate.speed)
        return 0

    monkeypatch.setattr(launcher, "run_served", serve)
    assert main(["-o", "out"], variables) == 0
    assert served == [speed]


def test_invalid_speed_starts_nothing(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["-o", "out"], {SPEED: "fast"}) == 1
    assert capsys.readouterr().err.startswith("Error: CELLWRIGHT_SPEED fast: ")
    assert not (tmp_path / "out").exists()


def test_build_folder_from_catkin_find_is_left_out_with_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    built, sources = tmp_path / "devel" / "share" / "osrf_gear", tmp_path / "src" / "ariac" / "osrf_gear"
    (built / "cmake").mkdir(parents=True)
    (sources / "config").mkdir(parents=True)
    config = sources / "config" / "sample.yaml"
    config.write_text("time_limit: 60\n")
    assert main(["-n", "-f", str(built), str(config)], {}) == 0
    printed = capsys.readouterr()
    assert "time_limit: 60" in printed.out
    assert (
        printed.err
        == f"Warning: {built}: catkin's build folder of osrf_gear has no configuration; going on with {config}\n"
    )
    assert main(["-n", "-f", str(built)], {}) == 1  # nothing else was named: an error as for any folder
