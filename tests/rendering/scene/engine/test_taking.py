"""Capture of a model: its scene has the model's shapes, and frames have their poses."""

from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.config.robot.robots import load_robot
from cellwright.engine.shapes import Visuals, at, box, mesh
from cellwright.mechanism.shapes import kinematics_of
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


def test_static_shapes_name_their_bodies() -> None:
    shapes = small()[2].scene.shapes
    found = {shape.form: shape.static_body for shape in shapes if shape.static_body}
    assert found == {ShapeType.PLANE: "world", ShapeType.BOX: "stand"}


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


def _places(capture: SceneCapture, frame: SceneFrame, *, visual: bool) -> Any:
    """Return the positions (n, 3) in the world of shown shapes that are only seen, or of the others."""
    bodies = [Pose(tuple(row[:3].tolist()), tuple(row[3:].tolist())) for row in frame.poses]
    shapes = [shape for shape in capture.scene.shapes if (shape.layer is ShapeLayer.LOOKS) == visual]
    shapes = [shape for shape in shapes if frame.shown[shape.body]]
    return np.array([(bodies[shape.body] @ shape.pose).position for shape in shapes])


def test_shapes_of_cell_match_geoms_and_visuals() -> None:
    cell = Cell(load_trial("lesson"))
    model, data = cell.simulation.model, cell.simulation.data
    for _ in range(50):
        cell.step()
    cell.simulation.refresh()
    capture = SceneCapture.of(cell)
    frame = capture.frame(data, cell.simulation.now)
    waiting = {body.name: body.body for body in cell.world.bodies}
    drawn = (model.geom_rgba[:, 3] > 0) & ~np.isin(model.geom_bodyid, list(waiting.values()))
    assert _places(capture, frame, visual=False) == pytest.approx(data.geom_xpos[drawn], abs=1e-4)
    expected = sorted(
        (Pose(tuple(data.body(body).xpos), tuple(data.body(body).xquat)) @ shape.pose).position
        for body, shape in cell.world.visuals.shapes
        if body not in waiting
    )
    found = sorted(map(tuple, _places(capture, frame, visual=True).tolist()))
    assert len(found) == len(expected)
    assert np.sort(found, axis=0) == pytest.approx(np.sort(expected, axis=0), abs=1e-4)


def test_shapes_of_robot_match_geoms() -> None:
    node = RobotNode(load_robot("qinglong", print))
    simulation, model = node.simulation, node.world.model
    for _ in range(50):
        simulation.step()
    simulation.refresh()
    capture = SceneCapture.of(node)
    frame = capture.frame(simulation.data, simulation.now)
    expected = kinematics_of(model, simulation.data).geom_xpos[model.geom_rgba[:, 3] > 0]
    assert _places(capture, frame, visual=True) == pytest.approx(expected, abs=1e-4)


def test_visuals_are_on_bodies_and_have_their_meshes() -> None:
    model, _, _ = small()
    visuals = Visuals(meshes={"flake": (np.eye(4, 3), np.array([(0, 1, 2)]))})
    visuals.add("stand", box(0.2, 0.2, 0.2, at(x=1.0), (1.0, 0.0, 0.0, 1.0)))
    visuals.add("hand", mesh("flake", (0.0, 1.0, 0.0, 1.0), at(z=0.1)), box(1, 1, 1, at(), (0.0, 0.0, 0.0, 0.0)))
    bare, dressed = SceneCapture(model).scene, SceneCapture(model, visuals).scene
    on_stand, on_hand = sorted(set(dressed.shapes) - set(bare.shapes), key=lambda shape: shape.body)
    assert len(dressed.shapes) == len(bare.shapes) + 2  # without the transparent one
    assert dressed.bodies == bare.bodies
    assert (on_stand.body, dressed.bodies[on_hand.body]) == (0, "hand")
    assert on_stand.pose.position == pytest.approx((1.0, 1.0, 0.0))  # the stand is turned
    assert on_hand.pose.position == (0.0, 0.0, 0.1)
    assert on_hand.mesh is not None
    assert np.array_equal(dressed.meshes[on_hand.mesh].vertices, np.eye(4, 3))


def test_parts_out_of_play_are_hidden() -> None:
    cell = Cell(load_trial("lesson"))
    capture = SceneCapture.of(cell)
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
    before = SceneCapture.of(cell).scene
    for number in range(20):
        cell.parts.appear(f"populate_conveyor|gear_part_clone_{number}", Pose((1.2, 4.0 - 0.3 * number, 1.0)))
    after = SceneCapture.of(cell).scene
    assert encode_scene(after) == encode_scene(before)
    assert before.bodies[-20:] == tuple(f"populate_conveyor|gear_part_clone_{number}" for number in range(20))
