"""Table of the moving bodies of a cell, in which the arm and some parts are awake, for tests of its numbers."""

import mujoco
import numpy as np

from cellwright.cell.devices.movers import Movers
from cellwright.cell.devices.moving_bodies import MovingBodies
from cellwright.engine.bounding_boxes import Mask
from cellwright.engine.sleeping_groups import Groups, SleepingGroups
from tests.cell.devices.floor import Floor, named, one_of_each
from tests.support.places import BELT

BELT_SPEED = 0.2
GEAR = named("gear_part")


class Table:
    """The table of a cell in which the arm and some parts are awake."""

    def __init__(self, *loose: str) -> None:
        self.floor = Floor(one_of_each()).reset()
        self.model, self.data = self.floor.model, self.floor.simulation.data
        self.belt = int(self.model.geom_bodyid[self.model.geom(BELT.body).id])
        self.moving = MovingBodies(self.model, {self.belt: BELT.direction})
        arm = int(self.model.body_treeid[self.model.body("vacuum_gripper_link").id])
        self.is_awake: Mask = np.zeros(self.model.ntree, dtype=np.bool_)
        self.is_awake[[arm, *(int(self.model.body_treeid[self.floor.part(name).body]) for name in loose)]] = True
        self.arm_dofs = np.flatnonzero(self.model.dof_treeid == arm)
        sleeping = SleepingGroups(self.model, self.moving.boxes, self.moving.parts, self.moving.links)
        self.groups: Groups = sleeping.find(self.data, self.is_awake)
        self.belt_end = float(sleeping.fixed[self.belt].sides[1, 0])

    def movers(self, passengers: dict[int, int]) -> Movers:
        """Return the table with passengers, by body, on carriers."""
        return self.moving.movers(self.data, self.is_awake, self.groups, passengers, {self.belt: BELT_SPEED})

    def put(self, posture: list[float]) -> None:
        """Put the arm and its rail into a posture [rad, m]."""
        self.data.qpos[self.model.jnt_qposadr[self.model.dof_jntid[self.arm_dofs]]] = posture
        mujoco.mj_kinematics(self.model, self.data)
