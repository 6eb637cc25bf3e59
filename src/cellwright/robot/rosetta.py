"""Contract of rosetta for a robot's node: which topics are the state, the action and the pictures of a data set.

Rosetta records such sets of LeRobot with the tools of ROS 2, and lets policies of LeRobot drive the robot. Its rules
are those of its version 0.2.0: <https://github.com/iblnkn/rosetta>.
"""

from collections.abc import Sequence
from typing import Any, Final

import yaml

from cellwright.config.control import ControlSpace
from cellwright.config.robot.cameras import picture_cameras
from cellwright.config.robot.config import RobotConfig
from cellwright.middleware.bus import Qos
from cellwright.middleware.messages import full_name
from cellwright.robot.interface import IO_TELEOP, JOINTS
from cellwright.util.errors import UsageError

RATE: Final = 30
"""Usual frames in a second [Hz]; those of the node's cameras."""
_ROWS = {row.name: row for row in IO_TELEOP}
_COMMAND_QOS = Qos(is_reliable=False, depth=1)  # an old target is worth nothing
_ALIGN = {"strategy": "hold", "timeline": "header"}
_HEAD = """\
# Contract of rosetta 0.2 for {name}, written by `cellwright robot`: which topics a data set is made of.
# Run the node with `cellwright teleop ROBOT --ros2`. The action is what a policy commands. To record what was executed,
# after all limits, read /io_teleop/applied_joint_cmd in place of /io_teleop/joint_cmd.
"""


def rosetta_contract(config: RobotConfig, rate: int = RATE) -> str:
    """Return the contract of a robot's node as a YAML text.

    State and action have the channels of `ControlSpace.of_node`, as those of `cellwright export`. Topics, types and
    QoS are those of the node's interface.

    Args:
        config: the robot.
        rate: frames in a second [Hz].

    Raises:
        UsageError: the robot has nothing to command, or the rate is not positive.

    Example:
        >>> from cellwright import load_robot
        >>> contract = yaml.safe_load(rosetta_contract(load_robot("tandem")))
        >>> contract["robot_type"], contract["actions"]["action"][1]["select"]
        ('cellwright_tandem', ['position.gripper_0', 'position.gripper_1'])
    """
    channels = ControlSpace.of_node(config).channels
    joints = [f"position.{each.joint}" for each in channels if each.kind == "joint"]
    grippers = [f"position.gripper_{number}" for number in range(len(config.grippers))]
    if not joints and not grippers:
        raise UsageError(f"{config.name}: there is no joint to command; a contract needs one")
    if rate < 1:
        raise UsageError(f"rate: must be at least 1 Hz (got {rate})")
    observations: dict[str, Any] = {
        "observation.state": [
            *_joints("/io_teleop/joint_states", joints),
            *_joints("/io_teleop/gripper_states", grippers),
        ]
    }
    for name, camera in picture_cameras(config).items():
        observations[f"observation.images.{name}"] = {
            "channel": _channel("/io_teleop/camera_{sensor}/color", sensor=name),
            "align": {**_ALIGN},
            "apply": {"resize": [camera.height, camera.width]},
        }
    contract = {
        "robot_type": f"cellwright_{config.name}",
        "robot_interface": "ros2",
        "fps": rate,
        "observations": observations,
        "actions": {
            "action": [
                *_joints("/io_teleop/joint_cmd", joints, is_command=True),
                *_joints("/io_teleop/target_gripper_status", grippers, is_command=True),
            ]
        },
        "adjunct": [{"channel": _channel("/clock")}, {"channel": _channel("/io_teleop/status")}],
    }
    return _HEAD.format(name=config.name) + yaml.dump(contract, Dumper=_Plain, sort_keys=False, allow_unicode=True)


def _joints(topic: str, select: Sequence[str], *, is_command: bool = False) -> list[dict[str, Any]]:
    """Return the source of some positions on a topic of joint states; none without positions."""
    assert _ROWS[topic].type == JOINTS
    return (
        [{"channel": _channel(topic, is_command=is_command), "align": {**_ALIGN}, "select": [*select]}]
        if select
        else []
    )


def _channel(topic: str, *, sensor: str = "", is_command: bool = False) -> dict[str, Any]:
    row = _ROWS[topic]
    qos = _COMMAND_QOS if is_command else row.qos
    channel: dict[str, Any] = {
        "topic": row.of(sensor or None).name,
        "type": full_name(row.type),
        "qos": {
            "reliability": "reliable" if qos.is_reliable else "best_effort",
            "durability": "transient_local" if qos.is_transient_local else "volatile",
            "history": "keep_last",
            "depth": qos.depth,
        },
    }
    return {**channel, "safety": "hold"} if is_command else channel


class _Plain(yaml.SafeDumper):
    """Writer of YAML that repeats values in place of naming them."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 (nothing is named)
        """Return that nothing is named."""
        return True
