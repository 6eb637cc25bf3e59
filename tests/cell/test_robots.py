"""Robots in a cell: driven over their own topics, they leave the parts as they are until they touch them."""

from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright import Cell
from cellwright.config.robot.config import CameraConfig
from cellwright.middleware.messages.conversions import joint_state, pose_from_transform
from cellwright.middleware.messages.std_srvs import SetBoolRequest, TriggerRequest
from cellwright.util.pose import Pose
from tests.cell.robot_cells import ASIDE, AT_BIN, final01, tandem_cell

_ROUNDING = 5e-6
"""Distance [m] that rounding may move a cylinder: it rocks on other points of its rim."""


def go(cell: Cell, seconds: float) -> None:
    cell.simulation.step_until(cell.simulation.now + round(seconds * 1e9))


def command(cell: Cell, topic: str, **targets: float) -> None:
    cell.bus.publish(topic, joint_state([*targets], [*targets.values()], time=0))


@pytest.mark.slow
def test_robot_that_stands_aside_leaves_the_parts_as_they_are(tmp_path: Path) -> None:
    alone, cell = final01(tmp_path), final01(tmp_path, ASIDE)
    robot = cell.robots["qinglong"]
    for number in range(10):
        command(cell, "/io_teleop/joint_cmd", J_arm_r_01=0.1 * number, J_arm_l_04=0.5)
        go(alone, 0.2)
        go(cell, 0.2)
    assert [part.name for part in cell.parts.all] == [part.name for part in alone.parts.all]
    for part, same in zip(cell.parts.all, alone.parts.all, strict=True):
        place, its_place = cell.parts.pose(part).position, alone.parts.pose(same).position
        assert place == pytest.approx(its_place, abs=_ROUNDING), part.name
    boxes = [part for part in cell.parts.all if part.type == "piston_rod_part"]
    for part in boxes:
        assert cell.parts.pose(part).position == pytest.approx(
            alone.parts.pose(alone.parts.part(part.name)).position, abs=1e-9
        )
    assert robot.driver.read().positions == pytest.approx(robot.commander.applied, abs=5e-3)


def test_robot_follows_topics_of_its_namespace() -> None:
    cell = Cell(tandem_cell())
    robot = cell.robots["tandem"]
    states: list[Any] = []
    cell.bus.subscribe("/left/joint_states", states.append, node="/test")
    command(cell, "/left/joint_cmd", lift=0.2)
    go(cell, 2.0)
    assert robot.driver.read().positions[robot.commander.numbers["lift"]] == pytest.approx(0.2, abs=1e-3)
    newest = states[-1]
    assert newest.position[newest.name.index("lift")] == pytest.approx(0.2, abs=1e-3)
    assert 199 <= len(states) <= 201
    assert not any(topic.startswith("/io_teleop") for topic in cell.topics())


def test_services_of_robot_answer_in_its_namespace() -> None:
    cell = Cell(tandem_cell())
    assert cell.bus.call("/left/set_enabled", SetBoolRequest(data=False), node="/test").success
    command(cell, "/left/joint_cmd", lift=0.2)
    go(cell, 0.5)
    robot = cell.robots["tandem"]
    assert robot.driver.read().positions[robot.commander.numbers["lift"]] == pytest.approx(0.0, abs=1e-3)
    assert "/left/set_enabled" in robot.commander.why_ignored
    cell.bus.call("/left/set_enabled", SetBoolRequest(data=True), node="/test")
    answers: list[Any] = []
    cell.bus.call("/left_reset_robot", TriggerRequest(), node="/test").then(answers.append)
    go(cell, 3.0)
    assert [answer.success for answer in answers] == [True]


def test_trees_of_robot_never_sleep() -> None:
    cell = Cell(tandem_cell())
    go(cell, 3.0)
    model, data = cell.simulation.model, cell.simulation.data
    trees = {int(model.body_treeid[body]) for body in range(model.nbody) if model.body(body).name.startswith("tandem/")}
    trees.discard(-1)
    assert trees
    assert all(data.tree_asleep[tree] < 0 for tree in trees)
    part = cell.parts.all[0]
    assert data.tree_asleep[model.body_treeid[part.body]] >= 0
    command(cell, "/left/joint_cmd", lift=0.2)
    go(cell, 2.0)
    robot = cell.robots["tandem"]
    assert robot.driver.read().positions[robot.commander.numbers["lift"]] == pytest.approx(0.2, abs=1e-3)


def test_run_with_robot_is_repeated_bit_for_bit() -> None:
    hashes = []
    cell = Cell(tandem_cell())
    for _ in range(2):
        command(cell, "/left/joint_cmd", lift=0.2)
        go(cell, 0.4)
        hashes.append(cell.state_hash())
        cell.reset()
    assert hashes[0] == hashes[1]


def test_snapshot_restores_robot() -> None:
    cell = Cell(tandem_cell())
    command(cell, "/left/joint_cmd", lift=0.2)
    go(cell, 0.1)
    before = cell.snapshot()
    go(cell, 0.3)
    expected = cell.state_hash()
    cell.restore(before)
    go(cell, 0.3)
    assert cell.state_hash() == expected


def test_two_robots_are_driven_apart() -> None:
    cell = Cell(tandem_cell(AT_BIN.replace("  bins", "    other: {model: tandem, at: [-2, 0, 0], turn: 1}\n  bins")))
    command(cell, "/left/joint_cmd", lift=0.2)
    command(cell, "/io_teleop/joint_cmd", lift=0.1)
    go(cell, 2.0)
    for name, place in (("tandem", 0.2), ("other", 0.1)):
        robot = cell.robots[name]
        assert robot.driver.read().positions[robot.commander.numbers["lift"]] == pytest.approx(place, abs=1e-3)


def test_robot_pushes_parts() -> None:
    text = AT_BIN.replace("at: [0.8, 0.0]", "at: [5.0, 0.0]")
    cell = Cell(tandem_cell(text))
    model, data = cell.simulation.model, cell.simulation.data
    part, tip = cell.parts.all[0], model.body("tandem/right_tip").id
    cell.simulation.refresh()
    x, y, z = data.xpos[tip]
    start = cell.parts.pose(part).position
    model.opt.gravity[:] = 0.0
    data.qpos[part.qpos : part.qpos + 3] = (x, y, z + 0.02)
    cell.simulation.touch()
    cell.simulation.wake(part.body)
    go(cell, 0.3)
    assert not np.allclose(cell.parts.pose(part).position, start, atol=0.1)
    before = np.array(cell.parts.pose(part).position)
    command(cell, "/left/joint_cmd", lift=0.2)
    go(cell, 2.0)
    assert np.linalg.norm(cell.parts.pose(part).position - before) > 0.02
    assert mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "tandem/place") >= 0


def test_camera_on_the_head_sees_the_parts_before_it_in_its_frame() -> None:
    trial = tandem_cell(AT_BIN.replace("at: [0.8, 0.0]", "at: [0.6, 0.0]").replace("surface: 0.5", "surface: 0.7"))
    eye = {"pos_offset": [0.12, 0.0, 0.1], "target_offset": [0.6, 0.0, -0.5], "img_width": 160, "img_height": 120}
    config = replace(trial.robot_models["tandem"], cameras=(CameraConfig("head", {"name": "head", **eye}),))
    cell = Cell(replace(trial, robot_models={"tandem": config}))
    newest: dict[str, Any] = {}
    for topic in ("color", "depth", "camera_info"):
        cell.bus.subscribe(f"/left/camera_head/{topic}", partial(newest.__setitem__, topic))
    cell.bus.subscribe("/tf", partial(newest.__setitem__, "tf"))
    with closing(cell.simulation):
        go(cell, 0.11)
    parent = {each.child_frame_id: each for each in newest["tf"].transforms}
    world_T_eye, frame = Pose(), newest["color"].header.frame_id
    assert frame == "tandem_head_optical_frame"
    while frame != "world":
        world_T_eye = pose_from_transform(parent[frame].transform) @ world_T_eye
        frame = parent[frame].header.frame_id
    colour = newest["color"].data.reshape(120, 160, 3).astype(int)
    depth = newest["depth"].data.view(np.float32).reshape(120, 160)
    matrix = np.reshape(newest["camera_info"].k, (3, 3))
    for part in cell.parts.all:
        x, y, z = cell.parts.pose(part).position
        # on the ring of the gear, beside its hole
        place = np.array(world_T_eye.inverse().transform((x, y + 0.03, z + 0.01)))
        column, row, _ = np.rint(matrix @ place / place[2]).astype(int)
        red, green, blue = colour[row, column]
        assert red > green > blue + 60, part.name
        assert depth[row, column] == pytest.approx(place[2], abs=0.03)
