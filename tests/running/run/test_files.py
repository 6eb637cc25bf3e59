"""Tests of the files of a run: names, headers and contents."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.config.parsing.sources import sources_collected
from cellwright.config.trial.catalogue import find_trial
from cellwright.recording.format.format import EVENT, PANEL, STATE_HASH
from cellwright.recording.format.reader import RecordingFile
from cellwright.running.run import (
    CellTarget,
    Outcome,
    Program,
    RecordOptions,
    RunOptions,
    Session,
    load_trial,
    run_cell,
)
from cellwright.util.errors import UsageError
from cellwright.util.files import read_json_lines
from tests.running.run.test_session import Ends
from tests.support.cells import KITTING


class Delivers:
    """Sends off the kit on the tray."""

    def run(self, client: Client) -> None:
        """Work."""
        client.start_competition()
        client.sleep(1.1)
        client.control_agv(1, "order_0_kit_0")


def test_recording_of_run_has_score(tmp_path: Path) -> None:
    options = RecordOptions([tmp_path / "a.mcap", tmp_path / "a.bag"], {"agent": "delivers"})
    cell = Cell(KITTING, seed=3)
    result = run_cell(cell, Delivers(), record=options)
    assert result.is_recorded
    assert result.recordings == (tmp_path / "a.mcap", tmp_path / "a.bag")
    assert result.state_hash == run_cell(Cell(KITTING, seed=3), Delivers()).state_hash
    with RecordingFile(tmp_path / "a.mcap") as recording:
        facts = recording.header.facts
        assert (recording.header.kind, recording.header.name) == ("cell", "kitting")
        assert (facts["seed"], facts["agent"], facts["competition"], facts["timestep"]) == (
            3,
            "delivers",
            True,
            [1, 500],
        )
        events = [value["kind"] for _, value in recording.values(EVENT)]
        assert events[0] == "run"
        assert "kit" in events
        assert events[-1] == "result"
        assert recording.end is not None
        assert (recording.end["outcome"], recording.end["score"]) == ("done", result.score.total)
        assert list(recording.values(STATE_HASH))[-1][1]["hash"] == result.state_hash
        panels = [value for _, value in recording.values(PANEL)]
        assert panels[0]["state"] == "init"
        assert panels[-1]["score"] != panels[0]["score"]
        assert recording.start is None


def test_recording_has_start_and_sources_of_run(tmp_path: Path) -> None:
    with sources_collected() as sources:
        trial = load_trial("lesson")
    cell, start = Cell(trial), tmp_path / "start.npz"
    run_cell(cell, None, RunOptions(until=0.1, checkpoints=[(Fraction("0.05"), start)]))
    target = CellTarget(lambda: cell, lambda: [find_trial("lesson")], is_varied=True, sources=sources)
    options = RunOptions(until=0.2, start=start, checkpoints=[(Fraction("0.15"), start)])
    Session(target, record=tmp_path / "a.mcap", options=options).run()
    with RecordingFile(tmp_path / "a.mcap") as recording:
        name = "bundled/config/trial/catalogue/lesson.yaml"
        assert recording.sources == {name: find_trial("lesson").read_bytes()}
        facts = recording.header.facts
        assert (facts["files"], facts["varied"], facts["checkpoints"]) == ([name], True, [150_000_000])
        assert recording.begin == 50_000_000
        assert recording.start is not None


def test_recording_of_aborted_run_is_closed(tmp_path: Path) -> None:
    cell = Cell(KITTING)

    class BreakOffError(BaseException):
        pass

    class BreaksOff(Program):
        def work(self, session: Session) -> tuple[Outcome, str]:
            raise BreakOffError

    options = RecordOptions([tmp_path / "a.mcap"])
    with pytest.raises(BreakOffError):
        Session(cell, record=options).run(BreaksOff())
    with RecordingFile(tmp_path / "a.mcap") as recording:
        assert recording.is_complete
        assert recording.end == {"outcome": "broken off"}
    assert not cell.bus.on_input
    assert not cell.simulation.on_reset
    assert not cell.simulation.on_restart


def test_second_run_writes_own_files(tmp_path: Path) -> None:
    with Session(KITTING, record=[tmp_path / "a.mcap", tmp_path / "a.jsonl"]) as session:
        first, second = session.run(Ends), session.run(Ends)
    assert first.state_hash == second.state_hash
    assert (first.recordings, second.recordings) == ((tmp_path / "a.mcap",), (tmp_path / "a_2.mcap",))
    assert [line["kind"] for line in read_json_lines(tmp_path / "a_2.jsonl")][-1] == "result"


def test_log_of_robot_is_refused(tmp_path: Path) -> None:
    with (
        Session("tandem", record=tmp_path / "a.jsonl") as session,
        pytest.raises(UsageError, match="log: only a cell has a log"),
    ):
        session.run(until=0.1)
