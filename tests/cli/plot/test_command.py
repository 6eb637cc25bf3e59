"""Tests of `cellwright plot`: a figure of a recording, or one line with the reason against it."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.recorder import Recorder
from tests.cli.conftest import CommandLine
from tests.support.cells import WHOLE, run, start


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of a cell that has only started."""
    path = tmp_path_factory.mktemp("recordings") / "run.mcap"
    cell = Cell(WHOLE)
    recorder = Recorder(cell, path, RecordingHeader("cell", "whole", {"seed": 3}))
    start(cell)
    run(cell, 0.5)
    recorder.end({})
    return path


@pytest.mark.slow
def test_figure_is_written_to_working_folder(
    recording: Path, cellwright: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = cellwright("plot", str(recording))
    assert (ran.status, ran.out, ran.err) == (0, "figure      run-plot.png\n", "")
    assert (tmp_path / "run-plot.png").read_bytes().startswith(b"\x89PNG")


def test_panels_and_out_select_content_and_file(recording: Path, cellwright: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "score.SVG"
    assert cellwright("plot", str(recording), "--panels", "score, commands", "--out", str(out)).status == 0
    text = out.read_text()
    assert "points" in text
    assert "Tool" not in text


@pytest.mark.slow
def test_truncated_recording_is_plotted_with_warning(recording: Path, cellwright: CommandLine, tmp_path: Path) -> None:
    cut, out = tmp_path / "cut.mcap", tmp_path / "cut.png"
    data = recording.read_bytes()
    cut.write_bytes(data[:-2000])
    ran = cellwright("plot", str(cut), "--out", str(out))
    assert (ran.status, ran.err) == (0, f"warning: {cut}: cut short; plotted as far as it goes\n")
    assert out.exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nowhere.mcap",), "nowhere.mcap: cannot be read: No such file"),
        (("{text}",), "not an MCAP file"),
        (("{run}", "--panels", "scores"), "--panels: unknown panel 'scores'; did you mean score"),
        (("{run}", "--out", "a.jpg"), "--out a.jpg: give a file whose name ends in .png, .svg or .pdf"),
        (("{run}", "--out", "no/where/a.png"), "there is no folder"),
        (("{run}", "--panels", "trays"), "has nothing to plot in trays"),
    ],
)
def test_invalid_input_prints_one_line(
    arguments: tuple[str, ...], message: str, recording: Path, cellwright: CommandLine, tmp_path: Path
) -> None:
    text = tmp_path / "text.mcap"
    text.write_text("orders: {}")
    ran = cellwright("plot", *(each.format(run=recording, text=text) for each in arguments))
    assert (ran.status, ran.out) == (2, "")
    assert message in ran.err
    assert ran.err.startswith("error: ")
    assert ran.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == [text]
