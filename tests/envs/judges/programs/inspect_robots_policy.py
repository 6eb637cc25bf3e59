"""`inspect-robots` with the imitator as its policy `imitator`, in the interpreter of that judge.

`python inspect_robots_policy.py DEMONSTRATIONS REPORT ARGUMENT …` runs the command, and writes what was seen.
"""

import json
import sys
from pathlib import Path
from typing import Any

from imitator import Imitator
from inspect_robots.cli import main
from inspect_robots.policy import PolicyConfig, PolicyInfo
from inspect_robots.registry import register
from inspect_robots.types import Action, ActionChunk, Observation

DEMONSTRATIONS, REPORT, *ARGUMENTS = sys.argv[1:]
IMITATOR = Imitator(DEMONSTRATIONS)


@register("policy", "imitator")
class Policy:
    """The imitator as a policy of inspect-robots; it takes the actions of the embodiment that it is bound to."""

    def __init__(self) -> None:
        self.config = PolicyConfig()

    def bind(self, info: Any) -> None:
        self.info = PolicyInfo("imitator", info.action_space)

    def reset(self, scene: Any) -> None:
        IMITATOR.begin()

    def act(self, observation: Observation) -> ActionChunk:
        state = observation.extra["environment_state"]
        return ActionChunk([Action(IMITATOR.act(observation.state["joint_pos"], state, observation.instruction or ""))])


if __name__ == "__main__":
    status = main(ARGUMENTS)
    IMITATOR.end()
    Path(REPORT).write_text(json.dumps(IMITATOR.seen))
    sys.exit(status)
