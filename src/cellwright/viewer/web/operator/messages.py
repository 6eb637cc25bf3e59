"""Wishes as the messages that everybody sends to a robot's node."""

from __future__ import annotations

from typing import Any

from cellwright.clients.operators.orders import MoveBase, MoveGrippers, MoveJoints, MoveTips, Now
from cellwright.clients.operators.robot import EMERGENCY_STOP, GRIPPER_COMMAND, JOINT_COMMAND, TIP_COMMAND
from cellwright.middleware.messages import message_type
from cellwright.middleware.messages.build import floats, header, joint_state, pose_message
from cellwright.middleware.messages.standard import Bool, PoseArray

BASE_COMMAND = "/io_teleop/target_base_move"


def message(wish: MoveJoints | MoveTips | MoveGrippers | MoveBase | Now, time: int) -> tuple[str, Any]:
    """The topic that a wish goes to, and its message, stamped with `time` [ns] of the node's clock."""
    match wish:
        case MoveJoints():
            return JOINT_COMMAND, joint_state(list(wish.targets), list(wish.targets.values()), time=time)
        case MoveTips():
            return TIP_COMMAND, PoseArray(header(time=time), [pose_message(tip) for tip in wish.tips])
        case MoveGrippers():
            names = [f"gripper_{number}" for number in range(len(wish.closed))]
            return GRIPPER_COMMAND, joint_state(names, list(wish.closed), time=time)
        case MoveBase():
            array, layout = (message_type(f"std_msgs/{name}") for name in ("Float64MultiArray", "MultiArrayLayout"))
            return BASE_COMMAND, array(layout=layout(dim=[], data_offset=0), data=floats(wish.numbers))  # type: ignore[call-arg]
        case Now():
            return EMERGENCY_STOP, Bool(True)
