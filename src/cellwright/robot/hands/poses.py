"""Brings the tips of the arms to poses: each tick a step of inverse kinematics, aimed at through the commander.

The steps are made on a posture of its own (the desired one), not on the robot's: physics is left alone, the robot's
servos follow, and what is aimed at depends on nothing but the commands. Joints that do not belong to an arm are where
they are told to be; a waist is never moved to reach something.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation
from cellwright.robot.commander import Commander
from cellwright.robot.hands.inverse_kinematics import ArmSolver, Caps
from cellwright.robot.servos import Array, fastest
from cellwright.util.pose import Pose

TOPIC = "/io_teleop/target_ee_poses"
VELOCITY_SHARE = 0.9
"""Share of the speeds of the servos that a way to a pose makes use of: what is left, they need to keep up."""


@dataclass
class _Arm:
    """An arm, and where it is being brought: nowhere while `target` is None."""

    numbers: Array
    solver: ArmSolver
    reference: str
    positions: Array
    target: Pose | None = None


class EePoses(Device):
    """The poses of the tips of all arms: right, left.

    A later command for joints of an arm, whoever gives it, ends the way of that arm; the next poses begin a new one.

    Args:
        config: the robot.
        commander: whom joint targets go to.
        caps: how fast a tip may be brought to its target.
        velocity_share: share of the speeds that joints are driven with at most that may be used, above 0.
    """

    def __init__(
        self,
        config: RobotConfig,
        commander: Commander,
        *,
        caps: Caps | None = None,
        velocity_share: float = VELOCITY_SHARE,
    ) -> None:
        super().__init__("ee poses")
        self._config = config
        self._commander = commander
        self._caps = caps or Caps()
        self._velocity_share = velocity_share
        self._arms: list[_Arm] = []

    def attach(self, simulation: Simulation) -> None:
        """Look up joints and links."""
        super().attach(simulation)
        model, config = simulation.model, self._config
        self._model = model
        self._data = mujoco.MjData(model)
        self._timestep = float(simulation.clock.timestep)
        joints = self._commander.driver.joints
        self._qpos = np.array([model.joint(name).qposadr[0] for name in joints], dtype=int)
        for place, arm in enumerate(config.arms):
            tip = config.command_links[place] if place < len(config.command_links) else arm.tip
            reference = config.reference_links[place] if place < len(config.reference_links) else None
            driven = [config.robot.joint(name) for name in arm.joints]
            limits = [each.limits for each in driven]
            solver = ArmSolver(
                model,
                joints=arm.joints,
                tip=tip,
                reference=reference or config.robot.root,
                home=np.array(arm.home),
                lower=np.array([each.lower for each in limits]),
                upper=np.array([each.upper for each in limits]),
                velocity=self._velocity_share * np.array([fastest(each) for each in driven]),
                caps=self._caps,
            )
            numbers = np.array([joints.index(name) for name in arm.joints], dtype=int)
            self._arms.append(_Arm(numbers, solver, reference or config.robot.root, np.array(arm.home)))

    def reset(self) -> None:
        """Bring no arm anywhere."""
        for arm in self._arms:
            arm.target = None

    # ---------------------------------------------------------------- commands

    @property
    def references(self) -> tuple[str, ...]:
        """The link of each arm in whose frame its poses are given."""
        return tuple(arm.reference for arm in self._arms)

    @property
    def targets(self) -> tuple[Pose | None, ...]:
        """Where each tip is being brought, reference_T_tip; None for an arm that is not."""
        return tuple(arm.target for arm in self._arms)

    def aim(self, poses: Sequence[Pose | None]) -> None:
        """Begin to bring the tip of each arm to a pose, reference_T_tip; one for each arm, None to leave it alone."""
        measured = self._measured()
        for arm, pose in zip(self._arms, poses, strict=True):
            if pose is None:
                continue
            if arm.target is None or not self._commander.leads(TOPIC, arm.numbers):
                arm.positions = np.clip(measured[arm.numbers], arm.solver.lower, arm.solver.upper)
                self._commander.follow(TOPIC, arm.numbers, arm.positions)
            arm.target = pose

    def poses(self) -> list[Pose]:
        """Where the tips are, reference_T_tip, as the robot's joints were read last."""
        self._take_posture(self._measured())
        mujoco.mj_kinematics(self._model, self._data)
        return [arm.solver.pose(self._data) for arm in self._arms]

    def frames(self, link: str) -> list[Pose]:
        """reference_T_link of any link of the robot for the reference of each arm, as the joints were read last."""
        self._take_posture(self._measured())
        mujoco.mj_kinematics(self._model, self._data)
        return [arm.solver.frame(self._data, link) for arm in self._arms]

    # ---------------------------------------------------------------- what it does

    def before_step(self) -> None:
        """Aim the joints of each arm that is on its way one step further."""
        commander = self._commander
        moving = []
        for arm in self._arms:
            if arm.target is not None and commander.leads(TOPIC, arm.numbers):
                moving.append((arm, arm.target))
            else:
                arm.target = None
        if not moving:
            return
        data = self._data
        self._take_posture(commander.applied)
        for arm, _ in moving:
            data.qpos[arm.solver.qpos] = arm.positions
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_comPos(self._model, data)
        for arm, target in moving:
            moved = arm.positions + arm.solver.step(data, target, self._timestep)
            arm.positions = np.clip(moved, arm.solver.lower, arm.solver.upper)
            commander.follow(TOPIC, arm.numbers, arm.positions)

    def get_state(self) -> State:
        """Where the arms are being brought, and how far they are."""
        return {
            "targets": [arm.target and [*arm.target.position, *arm.target.quaternion] for arm in self._arms],
            "positions": [arm.positions.tolist() for arm in self._arms],
        }

    def set_state(self, state: State) -> None:
        """Go on from there."""
        for arm, target, positions in zip(self._arms, state["targets"], state["positions"], strict=True):
            arm.target = None if target is None else Pose(tuple(target[:3]), tuple(target[3:]))
            arm.positions = np.array(positions)

    # ---------------------------------------------------------------- inside

    def _take_posture(self, positions: Array) -> None:
        self._data.qpos[self._qpos] = positions

    def _measured(self) -> Array:
        """Where the joints are [rad; m]; those that the driver cannot tell of are where they were sent."""
        found = self._commander.driver.read().positions
        measured: Array = np.where(np.isfinite(found), found, self._commander.applied)
        return measured
