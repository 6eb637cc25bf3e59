"""Options of a policy that works a cell or a robot's node, and the names that its run has by them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from cellwright.cli import options
from cellwright.cli.parameters import flag, option
from cellwright.clients.policies.presets import preset_names
from cellwright.clients.policies.spec import AGENT, RECORDING, PolicySpec

PANEL = "Policy"
"""Heading for the options in the help."""
DEFAULT = "kitter"
"""Agent of commands without --agent."""


@dataclass(frozen=True)
class PolicyArguments:
    """Options of a policy."""

    policy: Annotated[
        str | None,
        option(
            "POLICY",
            "Let a policy work: a server at `ws://HOST:PORT`, `http://HOST:PORT/act` or `tcp://HOST:PORT`, your own as "
            "`path.py:Class`, `hold`, `random`, or the recording of such a run.",
            PANEL,
        ),
    ] = None
    policy_map: Annotated[
        str | None,
        option(
            "FILE",
            f"Map between the policy's names and those of the cell; or that of its kind: {', '.join(preset_names())}. "
            "Default: the cell's names.",
            PANEL,
        ),
    ] = None
    latency: Annotated[
        list[str] | None,
        option(
            "TIME",
            "How long an answer takes in simulation time: `120ms`, `uniform:60ms..180ms`, `normal:120ms,20ms`, "
            "`file:PATH`, `measured` or `measured:server`. Default: `measured`, but none while the world is frozen.",
            PANEL,
        ),
    ] = None
    policy_mode: Annotated[
        str | None,
        option(
            "MODE",
            "While it thinks: `async`, its last answer goes on; `sync`, the robot holds; `frozen`, the world stands. "
            "Default: `async` with --latency, else `frozen`.",
            PANEL,
        ),
    ] = None
    chunk: Annotated[
        int | None, option("N", "Ask again after N actions. Default: all, or half of them if async.", PANEL)
    ] = None
    think_first: Annotated[bool, flag("--think-first", "The world stands for the first answer.", PANEL)] = False
    sentence: Annotated[
        str | None, option("TEXT", "The task in words, for the policy. Default: the trial's.", PANEL)
    ] = None

    def specs(self, agent: str = DEFAULT) -> list[PolicySpec]:
        """Return the policy with each of the latencies; none if an agent works.

        Raises:
            UsageError: a value is not valid, or options do not go together.
        """
        given = {
            "--policy-map": self.policy_map is not None,
            "--latency": bool(self.latency),
            "--policy-mode": self.policy_mode is not None,
            "--chunk": self.chunk is not None,
            "--think-first": self.think_first,
            "--sentence": self.sentence is not None,
        }
        if self.policy is None:
            if agent == AGENT:
                options.refuse(f"--agent {AGENT} requires --policy, such as --policy ws://127.0.0.1:8000")
            if names := [name for name, is_given in given.items() if is_given]:
                options.refuse(f"{names[0]} requires --policy, such as --policy ws://127.0.0.1:8000")
            return []
        if agent not in (AGENT, DEFAULT):
            options.refuse(f"--agent {agent} and --policy: give one of them")
        latencies: Sequence[str] = self.latency or ("",)
        if twice := [each for number, each in enumerate(latencies) if each in latencies[:number]]:
            options.refuse(f"--latency {twice[0]} is given twice; leave one out")
        return [
            PolicySpec.of(
                self.policy,
                map_file=self.policy_map or "",
                latency=latency,
                mode=self.policy_mode or "",
                chunk=self.chunk,
                thinks_first=self.think_first,
                sentence=self.sentence or "",
            )
            for latency in latencies
        ]

    def spec(self, agent: str = DEFAULT) -> PolicySpec | None:
        """Return the only policy of a run; None if an agent works.

        Raises:
            UsageError: as for `specs`, or there are several latencies.
        """
        found = self.specs(agent)
        if len(found) > 1:
            options.refuse("--latency: one for a run; `cellwright eval` compares several")
        return found[0] if found else None


def is_recording(spec: PolicySpec) -> bool:
    """Return whether a policy is given as a recording."""
    return spec.policy.endswith(RECORDING)
