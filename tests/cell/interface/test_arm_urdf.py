"""Elements of a robot description."""

from __future__ import annotations

import math
from xml.etree.ElementTree import Element

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cellwright.cell.interface import parameters as urdf
from cellwright.config.robot.model import Inertial
from cellwright.engine.shapes import HERE, Shape, at, box, capsule, cylinder
from cellwright.util.pose import Pose
from tests.cell.interface.urdf_chain import origin_of

ANGLE = st.floats(-7.0, 7.0)
GREY = (0.5, 0.5, 0.5, 1.0)


def written(pose: Pose) -> Element:
    """Return an element with the pose as its origin."""
    robot = Element("robot")
    urdf.add_joint(robot, "fixed", "joint", "world", "link", pose)
    found = robot.find("joint")
    assert found is not None
    return found


@given(roll=ANGLE, pitch=ANGLE, yaw=ANGLE)
@example(roll=0.0, pitch=math.pi / 2, yaw=0.0)
@example(roll=-math.pi, pitch=math.pi / 2, yaw=math.pi / 2)
@example(roll=0.3, pitch=-math.pi / 2, yaw=-2.0)
@example(roll=0.3, pitch=math.pi / 2 - 1e-8, yaw=-2.0)
@example(roll=0.3, pitch=math.pi / 2 - 1e-6, yaw=-2.0)
@example(roll=90 * 0.0174533, pitch=0.0, yaw=0.0)
def test_rotation_survives_urdf_round_trip(roll: float, pitch: float, yaw: float) -> None:
    pose = Pose.from_rpy((1.0, -2.0, 0.3), (roll, pitch, yaw))
    matrix = origin_of(written(pose))
    columns = [pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    np.testing.assert_allclose(matrix[:3, :3], np.transpose(columns), atol=2e-7)
    assert matrix[:3, 3].tolist() == [1.0, -2.0, 0.3]


def test_numbers_are_written_without_rounding_noise() -> None:
    origin = written(Pose.from_rpy((0.1 + 0.2, -0.0, 0.0), (0.0, 0.0, 1.5708))).find("origin")
    assert origin is not None
    assert origin.attrib == {"xyz": "0.3 0.0 0.0", "rpy": "0.0 0.0 1.5708"}


@pytest.mark.parametrize(
    ("shape", "kinds", "lowest"),
    [
        (box(0.2, 0.4, 0.6, at(z=0.1), GREY), ["box"], -0.2),
        (cylinder(0.1, 0.5, HERE, GREY), ["cylinder"], -0.25),
        (Shape("sphere", (0.1, 0.0, 0.0), at(z=1.0)), ["sphere"], 0.9),
        (capsule(0.1, 0.5, HERE, GREY), ["cylinder", "sphere", "sphere"], -0.35),
    ],
    ids=["box", "cylinder", "sphere", "capsule"],
)
def test_shapes_become_visual_and_collision_geometry(shape: Shape, kinds: list[str], lowest: float) -> None:
    robot = Element("robot")
    urdf.add_link(robot, "link", solid=[shape])
    for role in ("visual", "collision"):
        elements = [*robot.iter(role)]
        assert [geometry[0].tag for element in elements for geometry in element.iter("geometry")] == kinds
        assert min(map(lowest_point, elements)) == pytest.approx(lowest)


def lowest_point(element: Element) -> float:
    """Return the z [m] of the lowest point of an upright shape."""
    form = element.find("geometry/*")
    assert form is not None
    height = float(origin_of(element)[2, 3])
    if form.tag == "box":
        return height - float(form.attrib["size"].split()[2]) / 2
    if form.tag == "sphere":
        return height - float(form.attrib["radius"])
    return height - float(form.attrib["length"]) / 2


def test_visual_shape_has_no_collision_geometry() -> None:
    robot = Element("robot")
    urdf.add_link(robot, "link", solid=[box(1, 1, 1, HERE, GREY)], seen=[cylinder(1, 1, HERE, GREY)])
    assert [each.tag for each in robot.iterfind("link/visual/geometry/*")] == ["box", "cylinder"]
    assert [each.tag for each in robot.iterfind("link/collision/geometry/*")] == ["box"]
    colour = robot.find("link/visual/material/color")
    assert colour is not None
    assert colour.attrib == {"rgba": "0.5 0.5 0.5 1.0"}


def test_link_has_its_inertia() -> None:
    form = Inertial(12.0, Pose((0.0, 0.0, 0.25)), (1.75, 1.75, 1.5, 0.0, 0.0, 0.0))
    robot = Element("robot")
    urdf.add_link(robot, "link", inertial=form)
    urdf.add_link(robot, "frame")
    (inertial,) = robot.iter("inertial")
    assert origin_of(inertial)[:3, 3].tolist() == [0.0, 0.0, 0.25]
    tensor = inertial.find("inertia")
    assert tensor is not None
    values = {key: float(value) for key, value in tensor.attrib.items()}
    assert values == {"ixx": 1.75, "iyy": 1.75, "izz": 1.5, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
