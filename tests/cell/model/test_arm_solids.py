"""The arm's solid shapes against the outlines of the original's meshes, and the room that they leave the arm."""

import json
from collections.abc import Iterator
from itertools import chain, pairwise
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.cell.model.arm_solids import FOOT, SOLID, Solid
from cellwright.clients.agents.kitter.ur10_on_rail import near_posture, station_posture
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.ur10 import INITIAL_POSITIONS
from cellwright.engine.shapes import Circle, Shape, Touch, lofted
from cellwright.motion import Joints, tool_down
from tests.cell.model.bench import Bench, cell
from tests.clients.agents.kitter.places import ARM
from tests.conftest import DATA
from tests.support.places import BIN_CENTRES, BIN_SURFACE

OUTLINES = json.loads((DATA / "ur10_link_outlines.json").read_text())["links"]
LINKS = {
    "base": "base_link",
    "shoulder": "shoulder_link",
    "upperarm": "upper_arm_link",
    "forearm": "forearm_link",
    "wrist1": "wrist_1_link",
    "wrist2": "wrist_2_link",
    "wrist3": "wrist_3_link",
}
NEAR = 0.0021
"""Maximum distance [m] of a shape from the original's surface."""

Points = NDArray[np.float64]


def corners_of(solid: Solid) -> Points:
    """Return the corners of a convex shape in the link's frame, shape (n, 3) [m]."""
    if not isinstance(solid, Shape):
        corners = solid.mesh[0]
    else:
        assert solid.kind == "cylinder"
        radius, half, _ = solid.size
        corners = lofted([Circle(radius, -half), Circle(radius, half)], 32)[0]
    return np.array([solid.pose.transform(tuple(corner)) for corner in corners])


def slab(shapes: list[Points], axis: int, low: float, high: float) -> Points:
    """Return points of the shapes between two coordinates along an axis, with the extreme ones; shape (n, 3) [m]."""

    def cut(corners: Points) -> Iterator[Points]:
        along = corners[:, axis]
        yield corners[(along >= low) & (along <= high)]
        for at in (low, high):
            before, behind = corners[along < at], corners[along > at]
            if len(before) and len(behind):
                share = (at - before[:, None, axis]) / (behind[None, :, axis] - before[:, None, axis])
                between = before[:, None] + share[..., None] * (behind[None] - before[:, None])
                yield between.reshape(-1, 3)

    return np.concatenate(list(chain.from_iterable(cut(corners) for corners in shapes)))


def is_near(extents: list[Any], expected: float) -> bool:
    """Return whether the maximum coordinate within a slice fits, for the slice cut back and grown by NEAR."""
    inner, outer = extents
    return bool(inner <= expected + NEAR and outer >= expected - NEAR)


@pytest.mark.parametrize("link", LINKS)
@pytest.mark.parametrize(
    ("outline", "axis", "half", "others"), [("along_z", 2, 0.005, (0, 1)), ("along_y", 1, 0.0025, (0, 2))]
)
def test_shapes_of_link_lie_within_2_mm_of_mesh(
    link: str, outline: str, axis: int, half: float, others: tuple[int, int]
) -> None:
    shapes = [corners_of(solid) for solid in SOLID[LINKS[link]]]
    for middle, *expected in OUTLINES[link][outline]:
        inner, outer = (slab(shapes, axis, middle - half - grow, middle + half + grow) for grow in (-NEAR, NEAR))
        for column, (other, sign) in enumerate((other, sign) for other in others for sign in (-1, 1)):
            extents = [(sign * points[:, other]).max(initial=-np.inf) for points in (inner, outer)]
            assert is_near(extents, sign * expected[column]), (middle, column, extents, expected[column])


@pytest.mark.parametrize(
    ("link", "height", "side"),
    [("forearm", "0.0", -1), ("forearm", "0.5723", 1), ("upperarm", "0.0", -1), ("upperarm", "0.612", 1)],
)
def test_housings_are_as_round_as_meshes(link: str, height: str, side: int) -> None:
    shapes = [corners_of(solid) for solid in SOLID[LINKS[link]]]
    for middle, radius in OUTLINES[link]["caps"][height]:
        extents = []
        for grow in (-NEAR, NEAR):
            points = slab(shapes, 1, middle - 0.0025 - grow, middle + 0.0025 + grow) - (0.0, 0.0, float(height))
            beyond = points[points[:, 2] * side >= 0.0]
            extents.append(np.hypot(beyond[:, 0], beyond[:, 2]).max(initial=-np.inf))
        assert is_near(extents, radius), (middle, extents, radius)


def test_foot_is_as_wide_as_mesh_in_all_directions() -> None:
    angles = np.radians(np.arange(0, 181, 5))
    directions = np.stack([np.cos(angles), np.sin(angles)])
    for height, *radii in OUTLINES["base"]["rings"]:
        ring = slab([corners_of(FOOT)], 2, height, height)[:, :2]
        expected = (np.array(radii) * directions).T
        assert (ring @ directions).max(axis=0) == pytest.approx((expected @ directions).max(axis=0), abs=NEAR)


def in_the_corners(rail_offset: float) -> Iterator[tuple[str, list[Joints]]]:
    """Yield paths down to the corners of the bins, with the rail offset [m] from where the arm points at them."""
    rest = Joints(*(INITIAL_POSITIONS[name] for name in ARM_JOINTS))
    for name, (x, y) in BIN_CENTRES.items():
        for corner in ((x + side, y + end) for side in (-0.25, 0.25) for end in (-0.25, 0.25)):
            rail = ARM.rail_beside(*corner) + rail_offset
            way = [station_posture(tool_down(*corner, 0.95), rail, rest)]
            for height in (0.90, 0.85, 0.80, BIN_SURFACE + 0.017):  # the last lays the cup onto a gear
                if way[-1] is not None:
                    way.append(near_posture(tool_down(*corner, height), rail, way[-1]))
            if None not in way:
                yield name, [joints for joints in way if joints is not None]


@pytest.mark.slow
def test_arm_reaches_corners_of_bins_without_contact() -> None:
    bench = Bench(cell(has_arm=True))
    model, data = bench.model, bench.data
    bodies = {model.body(link).id for link in LINKS.values()}
    solid = [geom for geom in range(model.ngeom) if model.geom_contype[geom] == Touch.ROBOT.value[0]]
    arm = [geom for geom in solid if model.geom_bodyid[geom] in bodies]
    around = [geom for geom in range(model.ngeom) if model.geom_contype[geom] == Touch.FIXED.value[0]]
    clear = dict.fromkeys(BIN_CENTRES, 0)

    def put(joints: Joints) -> None:
        for name, value in zip(ARM_JOINTS, joints, strict=True):
            data.qpos[model.joint(name).qposadr[0]] = value

    def clearance(joints: Joints) -> float:
        put(joints)
        mujoco.mj_kinematics(model, data)
        return float(min(mujoco.mj_geomDistance(model, data, a, b, 0.01, None) for a in arm for b in around))

    def contacts() -> set[str]:
        pairs = data.contact.geom[: data.ncon]
        return {model.body(model.geom_bodyid[geom]).name for geom in pairs.ravel()} & set(LINKS.values())

    for rail_offset in (-0.3, 0.0, 0.3):
        for name, way in in_the_corners(rail_offset):
            if min(map(clearance, way)) < 0.005:  # 3 mm from the outlines, within 2 mm of which the shapes lie
                continue
            clear[name] += 1
            put(way[0])
            data.qvel[:] = 0.0
            for last, following in pairwise(way):
                for share in np.linspace(0.0, 1.0, 100):
                    for joint, a, b in zip(ARM_JOINTS, last, following, strict=True):
                        bench.command(joint, a + share * (b - a))
                    mujoco.mj_step(model, data)
                    assert not contacts(), (name, rail_offset, contacts())
    assert {name for name, corners in clear.items() if corners >= 10} == {"bin5", "bin6", "bin7", "bin8"}, clear
