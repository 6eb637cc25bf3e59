"""Distances between the arms and robots of a cell, and the guard that stops arms before they come too near."""

from collections.abc import Callable, Iterable, Mapping
from itertools import combinations
from typing import ClassVar, Final, NamedTuple, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.devices.arm import Arm
from cellwright.cell.model.link_frames import frames_by_link
from cellwright.config.layout.arm_models import joints_of, moving_links
from cellwright.config.trial.trial import Trial
from cellwright.engine.clock import NANOSECONDS, nanoseconds
from cellwright.engine.device import Device
from cellwright.engine.simulation import Simulation

FAR: Final = 1e3
"""Distance [m] that no two arms or robots of a cell have."""

PERIOD: Final = NANOSECONDS // 50
"""Time between two looks of the guard [ns]."""

_WAY = 5 / 8
"""Way until rest, as a share of speed times duration: the stop is the first half of a quintic to the opposite speed."""

_APPROACH = 1e-4
"""Distance [m] by which arms must be nearer later than now to be stopped."""


class Nearest(NamedTuple):
    """Smallest distance of two arms or robots [m], negative where they overlap, and the frames of the links."""

    distance: float
    link: str
    other: str


class ArmDistances:
    """Distances between arms and robots by their shapes; reading them has no effect on a run.

    Args:
        simulation: the simulation.
        trial: its trial.
    """

    def __init__(self, simulation: Simulation, trial: Trial) -> None:
        self._simulation = simulation
        model = simulation.first_model  # the arms are the same in all
        self._rigid = model.body_weldid.astype(np.intp)[model.geom_bodyid]
        """Rigid body of each shape: that of the links which no joint moves relative to each other."""
        self._behind = model.body_weldid[model.body_parentid[self._rigid]].astype(np.intp)
        """The rigid body that carries it."""
        self._geoms: dict[str, NDArray[np.intp]] = {}
        self._links: dict[int, str] = {}
        """Frame of the link of each geom."""
        frames = frames_by_link(trial)
        links = {arm.name: moving_links(arm, trial.arm_models) for arm in trial.arms}
        for robot in trial.layout.robots:
            # all of them: a trunk that does not move is as much in the way
            links[robot.name] = [robot.prefix + link for link in trial.robot_models[robot.name].robot.links]
        for owner, names in links.items():
            bodies = [int(model.body(name).id) for name in names]
            solid = np.isin(model.geom_bodyid, bodies) & (model.geom_contype != 0)
            self._geoms[owner] = np.flatnonzero(solid)
            for geom in self._geoms[owner].tolist():
                self._links[geom] = frames[model.body(int(model.geom_bodyid[geom])).name]
        self.pairs: tuple[tuple[str, str], ...] = tuple(combinations(self._geoms, 2))
        """Names of the arms or robots of each pair."""

    def nearest(
        self, first: str, second: str, within: float = FAR, data: mujoco.MjData | None = None
    ) -> Nearest | None:
        """Return where two arms or robots are nearest; None if they are not nearer than `within` [m].

        Shapes whose bounding spheres are farther apart than others really are need no look.

        Args:
            first: name of an arm or a robot.
            second: name of another.
            within: distance from which on nothing is of interest.
            data: postures with the poses of their shapes; those of now by default.
        """
        if data is None:
            self._simulation.refresh()
            data = self._simulation.data
        model = data.model
        ones, others = self._geoms[first], self._geoms[second]
        apart = np.linalg.norm(data.geom_xpos[ones][:, None] - data.geom_xpos[others], axis=2)
        apart -= model.geom_rbound[ones][:, None] + model.geom_rbound[others]
        apart[self._are_joined(ones[:, None], others)] = FAR
        best = None
        for index in np.argsort(apart, axis=None).tolist():
            row, column = divmod(index, len(others))
            if apart[row, column] >= within:
                break
            pair = int(ones[row]), int(others[column])
            distance = mujoco.mj_geomDistance(model, data, *pair, within, None)
            if distance < within:
                within, best = distance, Nearest(distance, *(self._links[geom] for geom in pair))
        return best

    def _are_joined(self, ones: NDArray[np.intp], others: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Return which shapes never touch: a mount is fixed to the link that carries it, or a joint is between them."""
        one, other = self._rigid[ones], self._rigid[others]
        is_next = ((self._behind[ones] == other) & (other > 0)) | ((self._behind[others] == one) & (one > 0))
        return np.asarray((one == other) | is_next)


class ArmGuard(Device):
    """Guard that stops the arms which move, before one is nearer than a clearance to another or to a robot.

    It looks ahead at where the arms are to be when a stop from now on would be over. So it also stops an arm before it
    begins to move. Arms that move apart are not stopped. Robots count where they are, and are not stopped.

    Args:
        arms: the arms by name.
        clearance: smallest distance [m] of the postures that the arms are to take.
        trial: the trial.

    Attributes:
        on_stop: called with a line of text when it stops arms.
    """

    STATE: ClassVar = ("_halted",)

    def __init__(self, arms: Mapping[str, Arm], clearance: float, trial: Trial) -> None:
        super().__init__("arm_guard")
        self._arms, self._clearance, self._trial = arms, clearance, trial
        self.on_stop: list[Callable[[str], None]] = []
        self._horizon = nanoseconds(trial.settings.arm.stop_trajectory_duration * _WAY) + PERIOD
        self._halted: dict[str, int] = {}
        """Time at which the motion of a stopped arm ends [ns]: a new command ends at another time."""

    @classmethod
    def of(cls, trial: Trial, arms: Mapping[str, Arm]) -> Self | None:
        """Return the guard of a trial's arms; None if the cell has no clearance for them."""
        clearance = trial.layout.arm_clearance
        return None if clearance is None else cls(arms, clearance, trial)

    def attach(self, simulation: Simulation) -> None:
        """Find the shapes of the arms."""
        super().attach(simulation)
        self._distances = ArmDistances(simulation, self._trial)
        model = simulation.first_model
        self._posture = mujoco.MjData(model)
        self._joints = {
            arm.name: [
                int(model.joint(arm.prefix + name).qposadr[0]) for name in joints_of(arm, self._trial.arm_models)
            ]
            for arm in self._trial.arms
        }
        for arm in self._trial.arms:
            if arm.tool.fingers is not None:  # open, as they reach farthest
                for name in arm.gripper_names.joints:
                    self._posture.qpos[model.joint(name).qposadr[0]] = arm.tool.fingers.opening / 2
        self._robot_joints = [
            int(model.joint(robot.prefix + joint.name).qposadr[0])
            for robot in self._trial.layout.robots
            for joint in self._trial.robot_models[robot.name].robot.driven
        ]

    def reset(self) -> None:
        """Begin a run."""
        self._halted = {}
        self.simulation.schedule(self, "look", at=0)

    def handle_look(self) -> None:
        """Stop what is to come too near, and nearer than it is."""
        now = self.simulation.now
        self.simulation.schedule(self, "look", at=now + PERIOD)
        moving = {name for name, arm in self._arms.items() if arm.controller.end > now}
        pairs = [pair for pair in self._distances.pairs if moving.intersection(pair)]
        if not pairs:
            return
        ahead = self._distances_at(now + self._horizon, pairs)
        if not any(ahead):
            return
        present = self._distances_at(now, pairs)
        for pair, found, before in zip(pairs, ahead, present, strict=True):
            if found is not None and (before is None or found.distance < before.distance - _APPROACH):
                stopped = [name for name in pair if name in moving and self._stop(name)]
                for listener in self.on_stop if stopped else ():
                    away = f"{found.link} would be {found.distance * 1e3:.0f} mm from {found.other}"
                    listener(f"{' and '.join(stopped)} stopped: {away}")

    def _distances_at(self, time: int, pairs: Iterable[tuple[str, str]]) -> list[Nearest | None]:
        """Return the distances of pairs of arms where they are to be at a time [ns], if below the clearance."""
        for name, arm in self._arms.items():
            self._posture.qpos[self._joints[name]] = arm.controller.positions(time)
        self._posture.qpos[self._robot_joints] = self.simulation.data.qpos[self._robot_joints]
        mujoco.mj_kinematics(self._posture.model, self._posture)
        return [self._distances.nearest(*pair, within=self._clearance, data=self._posture) for pair in pairs]

    def _stop(self, name: str) -> bool:
        """Bring an arm to rest; return False if it is at it."""
        arm = self._arms[name]
        if self._halted.get(name) == arm.controller.end:
            return False
        arm.halt("another arm or a robot is too near")
        self._halted = {**self._halted, name: arm.controller.end}
        return True
