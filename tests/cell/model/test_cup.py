"""Suction cup: its shape, and its alignment to a part by the soft wrist."""

import math

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.arm import CUP_GEOM
from cellwright.config.trial.trial import Part
from cellwright.config.ur10 import GRIPPER
from cellwright.util.pose import Pose
from tests.cell.model.arm_poses import BY_BELT, ON_BELT, PICK, READY
from tests.cell.model.bench import Bench, cell, part_on
from tests.support.places import BELT_SURFACE, BIN_SURFACE


def drive(bench: Bench, start: dict[str, float], goal: dict[str, float], seconds: float) -> None:
    """Drive along a straight line in joint space, as the original's controller does with positions only."""
    timestep = bench.model.opt.timestep
    for k in range(round(seconds / timestep)):
        share = k * timestep / seconds
        for name in start:
            bench.command(name, start[name] + share * (goal[name] - start[name]), (goal[name] - start[name]) / seconds)
        mujoco.mj_step(bench.model, bench.data)
    for name in goal:
        bench.command(name, goal[name])


def touching(bench: Bench) -> dict[str, list[tuple[float, float]]]:
    """Return the contacts of the cup by body: (normal towards the cup . cup axis, distance [m]) of each."""
    cup = bench.model.geom(CUP_GEOM).id
    axis = bench.data.body(GRIPPER).xmat.reshape(3, 3)[:, 2]
    found: dict[str, list[tuple[float, float]]] = {}
    for contact in bench.data.contact:
        if cup in (contact.geom1, contact.geom2):
            other, sign = (contact.geom1, 1) if contact.geom2 == cup else (contact.geom2, -1)
            name = bench.model.body(bench.model.geom_bodyid[other]).name
            found.setdefault(name, []).append((float(sign * contact.frame[:3] @ axis), float(contact.dist)))
    return found


def test_cup_has_bevel_and_flat_face() -> None:
    model = Bench(cell(has_arm=True)).model
    geom = model.geom(CUP_GEOM)
    mesh = int(model.geom_dataid[geom.id])
    first = int(model.mesh_vertadr[mesh])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
    world = vertices @ data.geom_xmat[geom.id].reshape(3, 3).T + data.geom_xpos[geom.id]
    gripper = data.body(GRIPPER)
    local = (world - gripper.xpos) @ gripper.xmat.reshape(3, 3)
    heights = sorted({round(float(z), 6) for z in local[:, 2]})
    assert heights == [-0.005, 0.003, 0.005]
    face = local[np.isclose(local[:, 2], -0.005, atol=1e-6)]
    assert len(face) == 24
    assert np.hypot(face[:, 0], face[:, 1]) == pytest.approx([0.038] * 24, abs=1e-6)
    assert np.hypot(local[:, 0], local[:, 1]).max() == pytest.approx(0.05, abs=1e-6)
    assert (geom.friction[0], geom.priority[0], geom.gap[0], geom.margin[0]) == (0.1, 1, 0.001, 0.0)


@pytest.mark.parametrize("shift", [0.0, 0.13])
def test_pick_pushed_into_part_lays_cup_flat(shift: float) -> None:
    """The waypoint lies 5 mm inside the piston rod and 3.5 deg tilted: the part stops the arm, the wrist turns."""
    rods = [
        Part(f"bin7|piston_rod_part_{n}", "piston_rod_part", Pose.from_rpy((-0.3, y, 0.75), (0, 0, math.pi / 4)))
        for n, y in ((5, 0.03), (6, 0.163333))
    ]
    bench = Bench(cell(*rods, has_arm=True))
    bench.put_arm(READY)
    bench.run(0.5)
    drive(bench, READY, {**PICK, "linear_arm_actuator_joint": 0.25 + shift}, 1.0)
    bench.run(0.1)
    contacts = touching(bench)[f"bin7|piston_rod_part_{5 if shift == 0.0 else 6}"]
    assert min(alignment for alignment, _ in contacts) > 0.99
    assert -5e-4 < min(gap for _, gap in contacts) < 0.0
    # the face is above the bin's floor by the part's height, except for its tilt over the part's edge
    assert bench.body_pose(GRIPPER).position[2] == pytest.approx(BIN_SURFACE + 0.0075 + 0.005, abs=3e-3)


def test_pick_from_belt_meets_mark_of_gear() -> None:
    """1.5 s after the gear breaks the beam the cup rests on its mark, 3 mm high, while the belt runs."""
    bench = Bench(cell(part_on("gear_part", 1.21, 2.6, BELT_SURFACE), has_arm=True))
    bench.put_arm(BY_BELT)
    bench.set_belt(0.2)
    part = bench.world.parts[0]
    while bench.position(part)[1] > 2.25 + 0.039:
        mujoco.mj_step(bench.model, bench.data)
    bench.run(0.4)
    drive(bench, BY_BELT, ON_BELT, 1.0)
    met = 0
    for _ in range(10):
        bench.run(0.02)
        mujoco.mj_kinematics(bench.model, bench.data)
        contacts = touching(bench).get(part.name, [])
        met += bool(contacts) and min(alignment for alignment, _ in contacts) > 0.95
    assert met >= 9


def test_contact_within_gap_has_no_force() -> None:
    """Within the gap of 1 mm a contact exists, with a positive distance and no force."""
    bench = Bench(cell(part_on("disk_part", 0.0, 0.0, 0.0), has_arm=True), sleep=False)
    part, cup = bench.world.parts[0], bench.model.geom(CUP_GEOM).id
    world_T_gripper = bench.body_pose(GRIPPER)
    seen = {}
    for distance in (0.0005, 0.0015):
        below = world_T_gripper @ Pose((-0.03, -0.03, -0.005 - distance - 0.026))
        bench.place(part, below.position, world_T_gripper.quaternion)
        mujoco.mj_forward(bench.model, bench.data)
        contacts = [c for c in bench.data.contact if cup in (c.geom1, c.geom2)]
        seen[distance] = [(float(c.dist), int(c.efc_address)) for c in contacts]
    assert all(gap == pytest.approx(0.0005, abs=1e-6) and row < 0 for gap, row in seen[0.0005])
    assert seen[0.0005]
    assert seen[0.0015] == []
