"""Tests of windows, pictures and own drivers of `cellwright teleop`; docs/adapt-a-robot.md takes a picture too."""

from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine

EXAMPLE = Path(__file__).parents[3] / "examples" / "my_driver.py"
SHORT = ("--until", "0.05", "--port", "0")


def test_snapshot_to_missing_folder_is_refused(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright("teleop", "tandem", *SHORT, "--snapshot", str(tmp_path / "no" / "such" / "place.png"))
    assert ran.status == 2
    assert ran.err.count("\n") == 1


def test_gui_without_display_is_refused(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    for option in ("--gui", "--init-debug"):
        ran = cellwright("teleop", "tandem", *SHORT, option)
        assert ran.status == 2
        assert ran.err.startswith("error: window cannot open: ")
        assert ran.err.count("\n") == 1


def test_own_driver_runs_in_robot_node(cellwright: CommandLine) -> None:
    ran = cellwright("teleop", "tandem", *SHORT, "--driver", f"{EXAMPLE}:MyDriver")
    assert ran.status == 0, ran.err
    assert "0 taken" in ran.out
    assert "simulated" not in ran.out  # there is no simulation


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--driver", "my_driver.py"], "a driver must be path.py:Class"),
        (["--driver", f"{EXAMPLE}:MineDriver"], "did you mean MyDriver"),
        (["--driver", f"{EXAMPLE}:MyDriver", "--sim-time"], "a real robot runs in real time"),
        (["--driver", f"{EXAMPLE}:MyDriver", "--motion", "teleport"], "leave out --motion teleport"),
        (
            ["--driver", f"{EXAMPLE}:MyDriver", "--motion", "teleport", "--self-collision"],
            "simulates nothing; leave out --motion teleport and --self-collision",
        ),
        (["--check-driver"], "--check-driver requires --driver"),
        (["--driver", f"{EXAMPLE}:MyDriver", "--check-driver", "--check"], "give one of them"),
        (["--driver", f"{EXAMPLE}:MyDriver", "--check-driver", "--max-speed", "0.1"], "leave out the safety options"),
    ],
)
def test_invalid_driver_options_are_refused(cellwright: CommandLine, arguments: list[str], message: str) -> None:
    ran = cellwright("teleop", "tandem", *SHORT, *arguments)
    assert ran.status == 2
    assert message in ran.err
    assert ran.err.count("\n") == 1


def test_check_driver_reports_failure_of_driver(cellwright: CommandLine, tmp_path: Path) -> None:
    file = tmp_path / "drivers.py"
    file.write_text(EXAMPLE.read_text().replace("self._targets = np.array(targets)", "raise OSError('no power')"))
    ran = cellwright("teleop", "tandem", "--driver", f"{file}:MyDriver", "--check-driver")
    assert ran.status == 1
    assert ran.out == f"{file}:MyDriver: the driver failed: OSError: no power\n"
