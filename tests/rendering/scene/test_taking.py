"""Capture of a model: its scene has the model's shapes, and frames have their poses."""

from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.config.robot.robots import load_robot
from cellwright.rendering.scene import ShapeLayer, ShapeType
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.scene.scene import SceneFrame, encode_scene
from cellwright.robot.node import RobotNode
from cellwright.running.run import load_trial
from cellwright.util.pose import Pose
from tests.rendering.scene.scenes import small


def test_moving_bodies_are_those_on_joints_and_mocap_bodies() -> None:
    capture = small()[2]
    assert capture.scene.bodies == ("world", "arm", "hand", "cart", "load", "ball", "ghost")


def test_static_shapes_are_in_world_with_their_poses() -> None:
    _, _, capture = small()
    box = next(shape for shape in capture.scene.shapes if shape.form is ShapeType.BOX)
    assert box.body == 0
    assert box.pose.position == pytest.approx((1.0, 1.0, 0.0))
    assert abs(box.pose.quaternion[3]) == pytest.approx(np.sqrt(0.5))


def test_shapes_have_form_size_colour_and_layer() -> None:
    shapes = {shape.form: shape for shape in small()[2].scene.shapes}
    assert shapes[ShapeType.BOX].colour == (0.0, 0.0, 1.0, 1.0)
    assert shapes[ShapeType.CAPSULE].size[:2] == pytest.approx((0.05, 0.3))
    assert shapes[ShapeType.CAPSULE].colour[3] == 0.5
    assert {form: shape.layer for form, shape in shapes.items()} == {
        ShapeType.PLANE: ShapeLayer.LOOKS,
        ShapeType.BOX: ShapeLayer.BOTH,
        ShapeType.CAPSULE: ShapeLayer.TOUCH,
        ShapeType.MESH: ShapeLayer.LOOKS,
        ShapeType.ELLIPSOID: ShapeLayer.MARK,
        ShapeType.CYLINDER: ShapeLayer.BOTH,
        ShapeType.SPHERE: ShapeLayer.BOTH,
    }


def test_invisible_shapes_are_omitted() -> None:
    capture = small()[2]
    ghost = capture.scene.bodies.index("ghost")
    assert not [shape for shape in capture.scene.shapes if shape.body == ghost]


def test_frame_has_poses_and_visibility_of_bodies() -> None:
    model, data, _ = small()
    ghost, hand = model.body("ghost").id, model.body("hand").id
    capture = SceneCapture(model, parts=lambda: (("here", ghost, True), ("away", ghost, False)))
    data.joint("swing").qpos[0] = np.pi / 2
    mujoco.mj_kinematics(model, data)
    frame = capture.frame(data, 7)
    assert frame.time == 7
    # the stand is turned as well
    assert frame.poses[capture.index(hand), :3] == pytest.approx((0.4, 0.0, 1.0), abs=1e-6)
    assert capture.scene.bodies[-2:] == ("here", "away")
    assert frame.shown.tolist() == [name != "away" for name in capture.scene.bodies]
    assert frame.poses[-2, :3] == pytest.approx(data.body("ghost").xpos, abs=1e-6)
    assert frame.poses[-1].tolist() == [0, 0, 0, 1, 0, 0, 0]
    assert capture.index(0) == capture.index(model.body("stand").id) == 0


def _places(capture: SceneCapture, frame: SceneFrame) -> Any:
    bodies = [Pose(tuple(row[:3].tolist()), tuple(row[3:].tolist())) for row in frame.poses]
    return np.array([(bodies[shape.body] @ shape.pose).position for shape in capture.scene.shapes])


@pytest.mark.parametrize("kind", ["cell", "robot"])
def test_shapes_on_bodies_match_engine_geoms(kind: str) -> None:
    served: Cell | RobotNode = (
        Cell(load_trial("lesson")) if kind == "cell" else RobotNode(load_robot("qinglong", print))
    )
    simulation = served.simulation
    for _ in range(50):
        simulation.step()
    simulation.refresh()
    capture = SceneCapture(simulation.model, parts=served.scene_parts)
    frame = capture.frame(simulation.data, simulation.now)
    model, parts = simulation.model, served.scene_parts()
    roots = model.body_rootid[model.geom_bodyid]
    first = min((body for _, body, _ in parts), default=model.nbody)
    geoms = [np.flatnonzero(roots < first), *(np.flatnonzero(roots == body) for _, body, is_shown in parts if is_shown)]
    drawn = [geom for geom in np.concatenate(geoms) if model.geom_rgba[geom, 3] > 0]
    shown = [frame.shown[shape.body] for shape in capture.scene.shapes]
    assert _places(capture, frame)[shown] == pytest.approx(simulation.data.geom_xpos[drawn], abs=1e-4)


def test_parts_out_of_play_are_hidden() -> None:
    cell = Cell(load_trial("lesson"))
    capture = SceneCapture(cell.simulation.model, parts=cell.scene_parts)
    cell.simulation.refresh()
    frame = capture.frame(cell.simulation.data, 0)
    for name in cell.parts.names:
        assert frame.shown[capture.scene.bodies.index(name)] == (name in cell.parts.in_play)
    assert not frame.shown.all()


def test_parts_are_read_for_each_frame() -> None:
    model, data, _ = small()
    ball, ghost = model.body("ball").id, model.body("ghost").id
    one, other = (("a", ball, True), ("b", ghost, False)), (("a", ghost, True), ("b", ball, True))
    now = [one]
    capture = SceneCapture(model, parts=lambda: now[0])
    frames = []
    for now[0] in (one, one, other):
        frames.append(capture.frame(data, 0))
    assert [frame.shown[-2:].tolist() for frame in frames] == [[True, False], [True, False], [True, True]]
    assert [frame.poses[-2, 2] for frame in frames] == [2.0, 2.0, 4.0]
    assert frames[0].shown is frames[1].shown  # the same array, which is fast to compare


def test_scene_is_the_same_whichever_bodies_parts_have() -> None:
    cell = Cell(load_trial("lesson"))
    before = SceneCapture(cell.simulation.model, parts=cell.scene_parts).scene
    for number in range(20):
        cell.parts.appear(f"populate_conveyor|gear_part_clone_{number}", Pose((1.2, 4.0 - 0.3 * number, 1.0)))
    after = SceneCapture(cell.simulation.model, parts=cell.scene_parts).scene
    assert encode_scene(after) == encode_scene(before)
    assert before.bodies[-20:] == tuple(f"populate_conveyor|gear_part_clone_{number}" for number in range(20))
