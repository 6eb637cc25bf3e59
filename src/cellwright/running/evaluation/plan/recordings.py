"""Recordings of an evaluation whose agent sends recorded commands again: which one belongs to which run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from cellwright.clients.agents.agent import REPLAY
from cellwright.recording.format.reader import RecordingFile
from cellwright.running.evaluation.plan.sweep import variant_name
from cellwright.util.errors import RecordingError, UsageError

RunName = tuple[str, int, bool]
"""Trial with its overrides, seed, and whether the seed varied the cell."""

_SUFFIX = ".mcap"


class Recordings:
    """The recordings that an agent `replay:PATH` plays: one file for all runs, or a folder with one for each.

    Args:
        agent: the agent's name.

    Raises:
        UsageError: there is no such file or folder, two recordings are of one run, or a file is none.
    """

    def __init__(self, agent: str) -> None:
        self._path = Path(agent.removeprefix(REPLAY))
        self._by_run: Mapping[RunName, Path] = {}
        if self._path.is_dir():
            self._by_run = _runs_in(self._path)
        elif not self._path.is_file():
            raise UsageError(f"{agent}: there is no such recording or folder; write {REPLAY}run.mcap")

    def of(self, trial: str, seed: int, *, vary: bool) -> Path:
        """Return the recording of a run.

        Raises:
            UsageError: the folder has none.
        """
        if not self._path.is_dir():
            return self._path
        found = self._by_run.get((trial, seed, vary))
        if found is None:
            varied = ", varied" if vary else ""
            raise UsageError(
                f"{REPLAY}{self._path}: has no recording of {trial} seed {seed}{varied}; record it with "
                "`cellwright eval --record`, or leave it out"
            )
        return found


def is_replay(agent: str) -> bool:
    """Return whether an agent sends the commands of recordings."""
    return agent.startswith(REPLAY)


def _runs_in(folder: Path) -> dict[RunName, Path]:
    """Return the recordings in a folder, or in the folder `recordings` of an evaluation, by their runs."""
    files = sorted(folder.glob(f"*{_SUFFIX}")) or sorted((folder / "recordings").glob(f"*{_SUFFIX}"))
    found: dict[RunName, Path] = {}
    for file in files:
        try:
            with RecordingFile(file) as recording:
                run = _run_of(recording)
        except RecordingError as error:
            raise UsageError(f"{file}: {error}") from error
        if run in found:
            raise UsageError(
                f"{file}: is of {run[0]} seed {run[1]}, as {found[run].name} is; leave one recording of each run"
            )
        found[run] = file
    return found


def _run_of(recording: RecordingFile) -> RunName:
    facts = recording.header.facts
    seed, varied, overrides = facts.get("seed"), facts.get("varied"), facts.get("overrides", [])
    if type(seed) is not int or type(varied) is not bool or not isinstance(overrides, list):
        raise RecordingError("has no valid seed, variation or overrides; record the run again")
    return variant_name(recording.header.name, overrides), seed, varied
