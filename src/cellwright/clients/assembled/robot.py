"""The class that programs of the io_teleop stack make their controller nodes of."""

from __future__ import annotations

import os
import sys
from typing import Any, Mapping, Sequence

from cellwright.clients.assembled import services
from cellwright.clients.assembled.joints import Indices, Joints, JointStates, Lookup, Numbers
from cellwright.clients.assembled.parts import ROOT, RobotArm, RobotBase, RobotDorsal, RobotGripper, RobotHead
from cellwright.clients.assembled.process import RobotProcess
from cellwright.clients.assembled.table import index_table


class AssembledRobot:
    """A robot, put up as its configuration says, moving in real time in a process of its own.

    A subclass adds topics, and calls this class from the callbacks of its subscribers: every method may be called from
    any thread. Joints and links go by index (`cellwright robot FILE` prints the table). A configured robot has `arms`,
    right and left; `grippers`, `head` and `dorsal` are there only where they are configured: ask with `hasattr`.

    Args:
        robot_urdf_path: the URDF.
        configs: the robot configuration (`vr_configs.yml`) as `yaml.safe_load` has it.
        debug: print the index table, and open a window in which sliders move the joints.
        with_ee_constraint: kept as an attribute; `arms[].move_ee` is there in any case.
        physics_clent_id: of the original's engine (and spelt as there); kept as an attribute.

    Attributes:
        robot_id: always 0: there is one robot.
        joint_name2id_dict: index of each joint, fixed ones included.
        joint_id2name_dict: name of each joint.
        link_name2id_dict: index of each link but the root, which is -1.
        base: the root link.
        arms: as configured.
        address: host and port at which programs reach the robot's own node, with all topics of `cellwright teleop`.

    Raises:
        UsageError: the robot is not as it should be; the text says what is wrong.
    """

    python = sys.executable
    """The interpreter that Cellwright is installed for; under another one a subclass has to name it."""

    without_gui: bool | None = None
    """Set it to False, in the class or before `__init__`, to have MuJoCo's window opened; None: as the configuration's
    entry of this name says, and without a window where there is none."""

    def __init__(
        self,
        robot_urdf_path: str | os.PathLike[str],
        configs: Mapping[str, Any],
        debug: bool = False,  # noqa: FBT001 (called by position, as in the original)
        with_ee_constraint: bool = False,  # noqa: FBT001
        physics_clent_id: int = 0,
    ) -> None:
        self.configs = configs
        self.physics_clent_id = physics_clent_id
        self.with_ee_constraint = with_ee_constraint
        self.robot_id = 0
        if self.without_gui is None:
            self.without_gui = bool(configs.get("without_gui", True)) if isinstance(configs, dict) else True
        order = {
            "urdf": os.path.abspath(os.fspath(robot_urdf_path)),
            "configs": configs,
            "window": debug or not self.without_gui,
            "sliders": debug,
        }
        self._process = RobotProcess(self.python, order)
        self.address = self._process.address
        self._assemble(self._process.ask(services.DESCRIBE))
        if debug:
            sys.stdout.write(index_table(self._joints.table) + "\n")
            sys.stdout.flush()

    def _assemble(self, described: Mapping[str, Any]) -> None:
        self._joints = Joints(self._process, described)
        joints = self._joints
        names = {joint.name: joint.index for joint in joints.table}
        self.joint_name2id_dict: Lookup[int] = Lookup("joint", names)
        self.joint_id2name_dict: Lookup[str] = Lookup("joint index", {index: name for name, index in names.items()})
        self.link_name2id_dict: Lookup[int] = Lookup("link", {joint.link: joint.index for joint in joints.table})
        self.base = RobotBase(self._process, joints)
        self.arms = [RobotArm(self._process, joints, number, arm) for number, arm in enumerate(described["arms"])]
        waist = described["waist"] or {"joints": [], "home": []}
        self._waist = list(zip(waist["joints"], waist["home"]))
        if described["grippers"]:
            self.grippers = [RobotGripper(joints, gripper) for gripper in described["grippers"]]
        if described["head"] is not None:
            self.head = RobotHead(joints, described["head"])
        if described["dorsal"] is not None:
            self.dorsal = RobotDorsal(joints, described["dorsal"])

    # ---------------------------------------------------------------- joints

    def move_j(self, idx: Indices, pos: Numbers, max_vel: Sequence[float] = (), force: Sequence[float] = ()) -> None:  # noqa: ARG002
        """Have joints go to positions, cut off at their limits.

        Args:
            idx: indices.
            pos: as many positions [rad; m].
            max_vel: counts for nothing, as in the original: velocities are limited as the URDF says.
            force: counts for nothing, as in the original: efforts are limited as the URDF says.

        Raises:
            UsageError: there is no such joint, or a number is not finite; then none of them moves.
        """
        self._joints.move(idx, pos)

    def reset_j(self, idx: Indices, pos: Numbers) -> None:
        """Put joints at positions [rad; m], cut off at their limits, at once and at rest.

        Raises:
            UsageError: as for `move_j`.
        """
        self._joints.place(idx, pos)

    def reset_home(self) -> None:
        """Have arms, waist, head and lift go home, and open the grippers at once."""
        for arm in self.arms:
            self.move_j(arm.arm_joint_index, arm.home_j_pos)
        for index, position in self._waist:
            self.move_j(index, position)
        for part in ("head", "dorsal"):
            if hasattr(self, part):
                getattr(self, part).reset()
        for gripper in getattr(self, "grippers", ()):
            gripper.reset(0)

    def joint_states(self) -> JointStates:
        """All joints that are not fixed, in the order of their indices, as they are now."""
        return self._joints.states()

    def link_pose(self, idx: int = ROOT) -> list[list[float]]:
        """Where a link is in the world, [[x, y, z], [qx, qy, qz, qw]]; the root link when left out."""
        return [list(each) for each in self._joints.link_poses([idx])[0]]

    # ---------------------------------------------------------------- life

    @property
    def is_running(self) -> bool:
        """Whether the robot can be spoken to; False after `close`, or when its process has ended."""
        return self._process.is_running

    def close(self) -> None:
        """End the robot's process. It ends by itself when this program does."""
        self._process.close()
