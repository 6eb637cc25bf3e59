"""Arms of the page's cell as an operator has them: by the cell's description, and the reports of the agent."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cellwright.clients.agents.operator.tool_arms import OperatedArm, arms_of
from cellwright.clients.client.description import LAYOUT, chains_of, layout_of, robot_arms_of
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose
from cellwright.viewer.web.connection import Connection
from cellwright.viewer.web.operator.robot_state import pose_of


@dataclass(frozen=True)
class ArmReport:
    """Report of the agent about an arm.

    Attributes:
        mode: its activity.
        why: reason why it does not go on; empty if it does.
        is_upright: True if its tool is kept pointing down.
        meets_belt: True if it meets the speed of a belt below.
        aim: pose that its tool goes to, world_T_tool; None without one.
        joints: measured positions of its joints [rad; m].
    """

    mode: str
    why: str
    is_upright: bool
    meets_belt: bool
    aim: Pose | None
    joints: tuple[float, ...]


@dataclass(frozen=True)
class OperatorState:
    """Report of the agent.

    Attributes:
        arm: name of the chosen arm.
        is_stopped: True while nothing moves until the stop is cleared.
        has_begun: True once the competition has begun.
        note: newest note.
        arms: each arm by its name.
    """

    arm: str
    is_stopped: bool
    has_begun: bool
    note: str
    arms: Mapping[str, ArmReport]

    @classmethod
    def read(cls, state: Mapping[str, Any]) -> OperatorState:
        """Read a report.

        Raises:
            MessageError: it is none: any program may publish on its topic.
        """
        try:
            arms = {
                str(name): ArmReport(
                    str(each["mode"]),
                    str(each["why"]),
                    bool(each["upright"]),
                    bool(each["belt"]),
                    None if each["aim"] is None else pose_of(each["aim"]),
                    tuple(map(float, each["joints"])),
                )
                for name, each in state["arms"].items()
            }
            return cls(str(state["arm"]), bool(state["stopped"]), bool(state["begun"]), str(state["note"]), arms)
        except (AttributeError, KeyError, TypeError, ValueError) as fault:
            raise MessageError(f"operator: no report of this version: {fault!r}") from None


def described_arms(link: Connection) -> dict[str, OperatedArm]:
    """Ask a cell for its arms; return them by name.

    Raises:
        CellwrightError: it does not answer, or is of another version.
    """
    description = json.loads(link.call(LAYOUT, TriggerRequest()).message)
    layout = layout_of(description)
    found = arms_of(layout.arms, chains_of(description), layout.robots, robot_arms_of(description))
    return {each.name: each for each in found}
