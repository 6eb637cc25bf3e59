"""Running a recording again from the command line: how far it is, and whether it came out alike."""

from __future__ import annotations

import json
from typing import Any

import typer
from rich.console import Console

from cellwright.cli.bar import bar
from cellwright.cli.exit_status import BAD_INPUT, DONE, NOT_DONE
from cellwright.cli.lines import note
from cellwright.engine.clock import seconds
from cellwright.recording.format.reader import Recording
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.steps import steps
from cellwright.recording.replay.verdict import Answer, Moment, Verdict, versions_that_differ
from cellwright.recording.replay.verify import Verification
from cellwright.running.run import versions

_STATUS = {Answer.EQUAL: DONE, Answer.DIFFERENT: NOT_DONE, Answer.UNKNOWN: BAD_INPUT}


def verify(recording: Recording, console: Console, *, as_json: bool) -> int:
    """Run it again, and print what came of it; the exit status.

    Raises:
        RecordingError: it cannot be run again; the text says why.
    """
    recording.check_bytes()
    with rebuild(recording) as rebuilt, bar(console, "running again", seconds(recording.end_time)) as tell:

        def progress(time: int) -> None:
            if tell is not None:
                tell(seconds(time), f"{seconds(time):.0f} of {seconds(recording.end_time):.0f} s")

        verdict = Verification(rebuilt, progress).run(steps(recording))
    others = versions_that_differ(_versions(recording), versions())
    if as_json:
        typer.echo(json.dumps(document(verdict, others) | {"complete": recording.is_complete}, indent=2))
    else:
        show(console, verdict, others)
    return _STATUS[verdict.answer]


def document(verdict: Verdict, others: list[str]) -> dict[str, Any]:
    """The verdict as JSON values; times in s."""
    return {
        "answer": verdict.answer.value,
        "state_hashes": verdict.hashes,
        "frames": verdict.frames,
        "commands": verdict.commands,
        "equal_until": _moment(verdict.equal_until),
        "different_at": _moment(verdict.first_difference),
        "bodies": list(verdict.bodies),
        "error": verdict.fault,
        "begun": _moment(verdict.begun),
        "reached": _moment(verdict.reached),
        "wall": verdict.wall,
        "versions": others,
    }


def show(console: Console, verdict: Verdict, others: list[str]) -> None:
    """Print the verdict."""
    for name, text in _lines(verdict):
        note(console, name, text)
    for line in others:
        note(console, "version", line)


def _lines(verdict: Verdict) -> list[tuple[str, str]]:
    hashes = f"{verdict.hashes} state hash{'' if verdict.hashes == 1 else 'es'}"
    compared = f"{hashes} and {verdict.frames} frames equal, {verdict.commands} commands"
    lines = [("compared", compared)]
    match verdict.answer:
        case Answer.EQUAL:
            lines.append(("equal", f"up to {verdict.equal_until}"))
        case Answer.UNKNOWN:
            lines.append(("unknown", "it was cut before its first state hash: there is nothing to compare"))
        case Answer.DIFFERENT:
            until = "" if verdict.equal_until is None else f"; equal up to {verdict.equal_until}"
            first = verdict.first_difference or verdict.reached
            lines.append(("different", f"at {first}{until}"))
            if verdict.bodies:
                lines.append(("elsewhere", ", ".join(verdict.bodies)))
            if verdict.fault:
                lines.append(("error", verdict.fault))
    lines.append(("ran", f"{_length(verdict):.1f} s in {verdict.wall:.1f} s: {verdict.factor:.1f} x real time"))
    return lines


def _length(verdict: Verdict) -> float:
    return seconds(verdict.reached.time - verdict.begun.time)


def _moment(moment: Moment | None) -> dict[str, Any] | None:
    return None if moment is None else {"tick": moment.tick, "time": seconds(moment.time)}


def _versions(recording: Recording) -> dict[str, str]:
    found = recording.header.facts.get("versions")
    return {str(name): str(each) for name, each in found.items()} if isinstance(found, dict) else {}
