"""URDF of the QingLong: the committed file equals that of figures and drawing."""

import math
from xml.etree import ElementTree

import pytest

from cellwright.config.robot.model import link_poses
from cellwright.util.pose import Pose
from tools.qinglong.__main__ import PATH
from tools.qinglong.drawing import COLOURS, Shape
from tools.qinglong.urdf import drawing, figures, solids, urdf_text


def test_committed_urdf_equals_generated_one() -> None:
    """If this fails, run `python -m tools.qinglong`."""
    assert PATH.read_text("utf-8") == urdf_text()


def test_joints_stand_in_order_of_indices() -> None:
    root = ElementTree.fromstring(PATH.read_text("utf-8"))
    assert [element.get("name") for element in root.findall("joint")] == [joint.name for joint in figures().joints]


def test_shapes_are_on_links_and_in_known_colours() -> None:
    robot = figures()
    assert set(drawing(robot)) <= set(robot.links)
    assert {shape.colour for shapes in drawing(robot).values() for shape in shapes} == set(COLOURS)
    assert set(solids(robot)) <= set(drawing(robot))


def test_left_and_right_are_mirror_images() -> None:
    robot = figures()
    poses, drawn = link_poses(robot, {}), drawing(robot)
    for right in [name for name in drawn if "_r_" in name]:
        left = right.replace("_r_", "_l_")
        for one, other in zip(drawn[right], drawn[left], strict=True):
            x, y, z = (poses[right] @ one.pose).position
            assert (poses[left] @ other.pose).position == pytest.approx((x, -y, z), abs=1e-9)


def test_drawn_robot_has_height_of_robot_and_stands_on_both_soles() -> None:
    robot = figures()
    poses, drawn = link_poses(robot, {}), drawing(robot)
    lowest = {foot: _ends(poses[foot], drawn[foot])[0] for foot in ("Link_ankle_r_roll", "Link_ankle_l_roll")}
    assert lowest["Link_ankle_r_roll"] == pytest.approx(lowest["Link_ankle_l_roll"], abs=1e-6)
    top = _ends(poses["Link_head_pitch"], drawn["Link_head_pitch"])[1]
    assert top - lowest["Link_ankle_r_roll"] == pytest.approx(1.85, abs=0.03)
    assert min(_ends(poses[name], shapes)[0] for name, shapes in drawn.items()) == min(lowest.values())


def _ends(world_T_link: Pose, shapes: list[Shape]) -> tuple[float, float]:
    """Return the lowest and highest point of shapes [m]."""
    low, high = math.inf, -math.inf
    for shape in shapes:
        placed = world_T_link @ shape.pose
        axes = [abs(placed.rotate(axis)[2]) for axis in ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))]
        if shape.kind == "box":
            reach = sum(length / 2 * axis for length, axis in zip(shape.size, axes, strict=True))
        elif shape.kind == "sphere":
            reach = shape.size[0]
        else:
            reach = shape.size[1] / 2 * axes[2] + shape.size[0] * math.sqrt(max(0.0, 1 - axes[2] ** 2))
        low, high = min(low, placed.position[2] - reach), max(high, placed.position[2] + reach)
    return low, high
