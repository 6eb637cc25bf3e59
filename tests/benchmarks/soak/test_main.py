from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from benchmarks.soak import __main__ as module
from benchmarks.soak.__main__ import main
from benchmarks.soak.soak import SoakError, SoakResult


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--hours", "0.001"], "--hours 0.001: must be from 0.01 (one round) to 1000"),
        (["--hours", "nan"], "--hours nan"),
        (["--hours", "1e9"], "--hours 1e+09"),
        (["--pieces", "0"], "--pieces 0: must be at least 1"),
        (["--picture", "/none/such/a.svg"], "there is no folder /none/such"),
    ],
)
def test_bad_arguments_are_refused_with_reason(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert words in capsys.readouterr().err


@pytest.fixture
def soaks(monkeypatch: pytest.MonkeyPatch) -> dict[str, SoakResult | SoakError]:
    """Results of the long runs, by face."""
    found: dict[str, SoakResult | SoakError] = {}

    def soak(face: str, _rounds: int, _pieces: int, folder: Path, **_more: object) -> SoakResult:
        assert folder.is_dir()
        result = found.get(face, SoakResult(face, 1, whole={1: "aa"}, pieces={1: "aa"}))
        if isinstance(result, SoakError):
            raise result
        return result

    monkeypatch.setattr(module, "soak", soak)
    return found


def test_both_faces_are_reported_and_drawn(
    soaks: dict[str, object], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    from benchmarks.soak.memory import Sample

    for face in ("cell", "robot"):
        soaks[face] = SoakResult(face, 1, samples=[Sample(0.01, 80.0)], whole={1: "aa"}, pieces={1: "aa"})
    assert main(["--hours", "0.01", "--picture", str(tmp_path / "a.svg")]) == 0
    out = capsys.readouterr().out
    assert "cell: 0.01 simulated hours" in out
    assert "robot: 0.01 simulated hours" in out
    assert ET.parse(tmp_path / "a.svg").getroot().tag == "{http://www.w3.org/2000/svg}svg"


def test_state_difference_gives_exit_status_1(soaks: dict[str, object]) -> None:
    soaks["robot"] = SoakResult("robot", 1, whole={1: "aa"}, pieces={1: "ab"})
    assert main(["--hours", "0.01", "--face", "cell"]) == 0
    assert main(["--hours", "0.01"]) == 1


def test_dead_process_gives_error_and_exit_status_1(
    soaks: dict[str, object], capsys: pytest.CaptureFixture[str]
) -> None:
    soaks["cell"] = SoakError("cell: rounds 0 to 1: exit status -9")
    assert main(["--hours", "0.01"]) == 1
    assert capsys.readouterr().err == "error: cell: rounds 0 to 1: exit status -9\n"
