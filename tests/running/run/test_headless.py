"""Tests of a run in one line."""

from pathlib import Path

import pytest

import cellwright
from cellwright.clients.agents.agent import AgentError
from cellwright.clients.client.in_process import InProcess
from cellwright.util.errors import UsageError
from cellwright.util.files import read_json_lines

UNKNOWN_OPTION = "arm: {type: ur10}\noptions: {insert_agv: true}\n"


class Ender:
    """Waits for the order and ends the competition."""

    def run(self, client: cellwright.Client) -> None:
        assert isinstance(client.transport, InProcess)
        cell = client.transport.cell
        assert isinstance(cell, cellwright.Cell)
        self.seed = cell.seed
        client.start_competition()
        client.wait_for_order(timeout=1.0)
        client.end_competition()


@pytest.mark.slow
def test_run_trial_gives_result_of_run_cell() -> None:
    agent = Ender()
    result = cellwright.run_trial("lesson", agent, seed=3)
    assert agent.seed == 3
    assert result.outcome is cellwright.Outcome.DONE
    trial = cellwright.load_trial("lesson")
    again = cellwright.run_cell(cellwright.Cell(trial, seed=3), Ender())
    assert again.state_hash == result.state_hash


def test_run_trial_makes_agent_of_class() -> None:
    assert cellwright.run_trial("lesson", Ender).outcome is cellwright.Outcome.DONE


def test_class_that_is_no_agent_is_refused() -> None:
    class Demanding(Ender):
        def __init__(self, cell: object) -> None:
            raise AssertionError

    with pytest.raises(AgentError, match=r"Demanding: cannot be made: TypeError: .*'cell'"):
        cellwright.run_trial("lesson", Demanding)
    with pytest.raises(AgentError, match=r"an agent is a class with a method run\(client\)"):
        cellwright.run_trial("lesson", int)  # type: ignore[arg-type]


def test_run_trial_takes_name_of_agent() -> None:
    options = cellwright.RunOptions(until=0.5)
    result = cellwright.run_trial("lesson", "lesson", options=options)
    assert result.outcome is cellwright.Outcome.UNTIL
    with pytest.raises(AgentError, match="kitter"):
        cellwright.run_trial("lesson", "kiter")
    with pytest.raises(UsageError, match="until"):
        cellwright.run_trial("lesson", None)


def test_recording_of_run_trial_has_its_files(tmp_path: Path) -> None:
    options = cellwright.RunOptions(until=0.05)
    bare = cellwright.run_trial("lesson", None, options=options)
    result = cellwright.run_trial("lesson", None, record=tmp_path / "a.mcap", options=options)
    assert result.recordings == (tmp_path / "a.mcap",)
    with cellwright.open_recording(tmp_path / "a.mcap") as opened:
        recording = opened.recording
        assert recording.end is not None
        assert recording.end["state_hash"] == bare.state_hash
        assert recording.header.facts["agent"] == "none"
        assert list(recording.sources) == recording.header.facts["files"]


def test_run_trial_writes_files_by_their_suffixes(tmp_path: Path) -> None:
    files = [tmp_path / "a.mcap", tmp_path / "a.jsonl"]
    result = cellwright.run_trial("lesson", None, record=files, options=cellwright.RunOptions(until=0.05))
    assert result.recordings == (files[0],)
    first, *_, last = read_json_lines(files[1])
    assert (first["agent"], last["state_hash"]) == ("none", result.state_hash)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no disk that is always full")
def test_recording_on_full_disk_is_warning(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").symlink_to("/dev/full")
    options = cellwright.RunOptions(until=0.05)
    with pytest.warns(RuntimeWarning, match=r"a\.mcap: cannot be written any more"):
        result = cellwright.run_trial("lesson", None, record=tmp_path / "a.mcap", options=options)
    assert not result.is_recorded
    assert result.simulated == pytest.approx(0.05)
