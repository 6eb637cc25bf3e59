"""Policy of a run: the name of its agent, by its options, its seed, and the recording that it may be from."""

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.cli import options
from cellwright.cli.policies import PolicyArguments, is_recording
from cellwright.clients.policies.spec import REPORTS, PolicySpec


@dataclass(frozen=True)
class PolicyRun:
    """A policy for a run: `name` for people and files, and `spec` for the process that asks it."""

    name: str
    spec: PolicySpec

    def refuse(self, *, over: str | None, lockstep: bool) -> None:
        """Refuse a cell whose time would go on by the wall clock while the policy answers."""
        if over is not None and not lockstep:
            options.refuse(f"--over {over}: time must stand still while a policy answers; add --lockstep")

    def agent(self, cell: Cell) -> str:
        """Return the name of the agent for a cell, as `find_agent` takes it.

        Raises:
            DescriptionError: the policy's map does not fit the cell.
            UsageError: the cell has nothing to command.
        """
        from cellwright.clients.policies.program import check_policy  # it loads the wires

        check_policy(self.spec.words, cell.trial)
        return replace(self.spec, seed=cell.seed).words


def policy_of(given: PolicyArguments, agent: str, leaving: ExitStack) -> PolicyRun | None:
    """Return the policy of a run; None if an agent works. A recording's reports are in a file until `leaving` ends.

    Raises:
        UsageError: options do not go together, or the recording holds no episode of a policy.
        RecordingError: it cannot be read.
    """
    spec = given.spec(agent)
    if spec is None or not is_recording(spec):
        return None if spec is None else PolicyRun(spec.words, spec)
    from cellwright.recording.format.reader import RecordingFile  # slow to load
    from cellwright.recording.replay.policies import policy_reports

    with RecordingFile(Path(spec.policy)) as recording:
        reports = policy_reports(recording)
    if not reports:
        options.refuse(f"--policy {spec.policy}: holds no episode of a policy; record one with --policy and --record")
    folder = Path(leaving.enter_context(tempfile.TemporaryDirectory(prefix="cellwright-")))
    file = folder / f"episode{REPORTS}"
    file.write_text("".join(f"{report}\n" for report in reports), encoding="utf-8")
    return PolicyRun(spec.words, replace(spec, policy=str(file)))
