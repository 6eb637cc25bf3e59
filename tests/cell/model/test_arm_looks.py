"""Looks of the arm, and the face of its cup."""

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.arm import CUP_FACE_GEOM, CUP_GEOM
from cellwright.cell.model.arm_looks import CUP, CUP_FACE_RADIUS, SEEN
from cellwright.cell.model.arm_solids import SOLID
from cellwright.cell.model.build import build_world
from cellwright.config.trial.trial import Trial
from cellwright.engine.shapes import Role


def test_each_solid_link_has_looks() -> None:
    assert SEEN.keys() == SOLID.keys()


def test_cup_is_flat_within_the_radius_of_its_face() -> None:
    model = build_world(Trial("arm", has_arm=True)).model
    geom = model.geom(CUP_GEOM)
    number = int(geom.dataid[0])
    first, turn = model.mesh_vertadr[number], np.zeros(9)
    mujoco.mju_quat2Mat(turn, geom.quat)
    corners = model.mesh_vert[first : first + model.mesh_vertnum[number]] @ turn.reshape(3, 3).T + geom.pos
    lowest = corners[corners[:, 2] < corners[:, 2].min() + 1e-5]
    assert np.linalg.norm(lowest[:, :2], axis=1).max() == pytest.approx(CUP_FACE_RADIUS, rel=1e-3)
    assert corners[:, 2].min() == pytest.approx(-CUP.size[1], abs=1e-4)


def test_disc_of_the_face_touches_nothing_and_is_unseen() -> None:
    disc = build_world(Trial("arm", has_arm=True)).model.geom(CUP_FACE_GEOM)
    assert (int(disc.group[0]), int(disc.contype[0]), int(disc.conaffinity[0])) == (Role.UNSEEN, 0, 0)
