"""Hands of the QingLong: five fingers at the places of its joints."""

import pytest

from cellwright.config.robot.model import link_poses
from tools.qinglong.drawing import Shape, hand, hand_solids
from tools.qinglong.urdf import figures

FINGERS = ("ff", "mf", "rf", "lf", "th")


@pytest.mark.parametrize("side", ["rh", "lh"])
def test_finger_segment_is_drawn_up_to_next_joint(side: str) -> None:
    robot = figures()
    drawn = hand(robot, side)
    for finger in FINGERS:
        for part in ("proximal", "middle", "distal"):
            link = f"{side}_{finger}{part}"
            below = [joint for joint in robot.joints if joint.parent == link]
            reach = max(_top(shape.pose.position[2], shape) for shape in drawn[link])
            assert reach == pytest.approx(below[0].origin.position[2], abs=0.011)


@pytest.mark.parametrize("side", ["rh", "lh"])
def test_stretched_hand_has_thumb_up_and_palm_to_front(side: str) -> None:
    robot = figures()
    poses = link_poses(robot, {})
    palm = poses[f"{side}_palm"]
    assert poses[f"{side}_thtip"].position[2] > palm.position[2] + 0.03
    closed = link_poses(robot, {f"{side}_{finger}J3": 1.2 for finger in ("FF", "MF", "RF", "LF")})
    for tip in ("fftip", "mftip", "rftip", "lftip"):
        assert closed[f"{side}_{tip}"].position[0] > poses[f"{side}_{tip}"].position[0] + 0.05


@pytest.mark.parametrize("side", ["rh", "lh"])
def test_collision_shapes_are_inside_visual_shapes(side: str) -> None:
    robot = figures()
    seen, touched = hand(robot, side), hand_solids(robot, side)
    assert set(touched) <= set(seen)
    for name, (shape,) in touched.items():
        if shape.kind == "cylinder":
            assert shape.size[0] < max(each.size[0] for each in seen[name])


def _top(z: float, shape: Shape) -> float:
    return z + {"sphere": shape.size[0], "cylinder": 0.0}[shape.kind]
