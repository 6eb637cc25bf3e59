"""Policy of a run: the name of its agent, by its options, its seed, and the recording that it may be from."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

from cellwright.cell.cell import Cell
from cellwright.cli import options
from cellwright.cli.policies import DEFAULT, PolicyArguments, is_recording
from cellwright.clients.policies.spec import REPORTS, PolicySpec
from cellwright.config.robot.config import RobotConfig

if TYPE_CHECKING:
    from cellwright.clients.policies.agent import PolicyAgent


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

    def robot_agent(self, seed: int = 0) -> PolicyAgent:
        """Return the agent that asks it at a robot's node; drawn latencies are by the seed.

        Raises:
            PolicyError: there is no such policy.
        """
        from cellwright.clients.policies.program import policy_agent

        return policy_agent(replace(self.spec, seed=seed).words)()

    def check_robot(self, robot: RobotConfig, timestep: Fraction) -> None:
        """Refuse a map that does not fit a robot's node with steps of this length [s]; errors as of `agent`."""
        from cellwright.clients.policies.program import check_map
        from cellwright.clients.policies.robot_workplace import robot_names

        check_map(self.spec.words, robot_names(robot, timestep.as_integer_ratio()))


def policy_of(given: PolicyArguments, leaving: ExitStack, agent: str = DEFAULT) -> PolicyRun | None:
    """Return the policy of a run; None if an agent or a client works.

    A recording's reports are in a file until `leaving` ends.

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
