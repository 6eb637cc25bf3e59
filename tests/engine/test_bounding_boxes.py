"""Bounding boxes of bodies against the engine's own distances and positions."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.bounding_boxes import FAR, BodyBoxes, sums

MODEL = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" pos="0 0 -2"/>
    <body name="gate" pos="3 0 0" euler="0 0 30">
      <geom type="box" size=".05 .05 1" pos="0 -1 0"/><geom type="box" size=".05 .05 1" pos="0 1 0"/>
      <geom name="look" type="sphere" size="9" contype="0" conaffinity="0"/>
    </body>
    <body name="stone" pos="-3 1 0" euler="0 20 0"><geom type="box" size=".1 .2 .3"/></body>
    <body name="slider" pos="0 0 1"><joint name="rail" type="slide" axis="0 1 0" range="-1 1" limited="true"/>
      <geom type="capsule" size=".05 .2" contype="4" conaffinity="1"/>
      <body name="upper" pos="0 0 .3"><joint name="shoulder" axis="0 1 0" pos="0 0 .02"/>
        <geom type="cylinder" size=".04 .25" pos="0 0 .25" contype="4" conaffinity="1"/>
        <body name="fore" pos="0 0 .5"><joint name="elbow" axis="1 0 0"/>
          <geom type="box" size=".03 .03 .2" pos="0 .02 .2" contype="4" conaffinity="1"/></body></body></body>
    <body name="part" pos="1 1 1"><freejoint/>
      <geom type="cylinder" size=".1 .02" pos=".03 0 0" euler="40 0 0"/><geom type="sphere" size=".05" pos="0 .1 0"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(MODEL)


@pytest.fixture(scope="module")
def boxes(model: mujoco.MjModel) -> BodyBoxes:
    return BodyBoxes(model)


def posed(model: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """Return data in a random posture, with random velocities."""
    generator = np.random.default_rng(seed)
    data = mujoco.MjData(model)
    data.qpos[:3] = generator.uniform(-1, 1), *generator.uniform(-3, 3, 2)
    data.qpos[3:6] = generator.uniform(-2, 2, 3)
    data.qpos[6:10] = generator.normal(size=4)
    data.qvel[:] = generator.normal(size=model.nv)
    mujoco.mj_forward(model, data)
    return data


def body_ids(model: mujoco.MjModel, *names: str) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return np.array([model.body(name).id for name in names], dtype=np.int64)


@given(seed=st.integers(0, 2**32 - 1))
def test_gap_of_boxes_is_at_most_distance_of_shapes(model: mujoco.MjModel, boxes: BodyBoxes, seed: int) -> None:
    data = posed(model, seed)
    ids = body_ids(model, "slider", "upper", "fore", "part")
    around = boxes.at(ids, data.xpos[ids], data.xmat[ids])
    gaps = around.gaps(around)
    for row, one in enumerate(ids.tolist()):
        for column, other in enumerate(ids.tolist()):
            if one != other:
                geoms = [np.flatnonzero(model.geom_bodyid == each).tolist() for each in (one, other)]
                distance = min(
                    mujoco.mj_geomDistance(model, data, a, b, 50.0, None) for a in geoms[0] for b in geoms[1]
                )
                assert gaps[row, column] <= distance + 1e-6


@given(seed=st.integers(0, 2**32 - 1))
def test_no_point_is_faster_than_levers_allow(model: mujoco.MjModel, boxes: BodyBoxes, seed: int) -> None:
    data = posed(model, seed)
    for body in body_ids(model, "slider", "upper", "fore", "part").tolist():
        allowed = boxes.levers(body) @ np.abs(data.qvel)
        jacobian = np.zeros((3, model.nv))
        for geom in np.flatnonzero(model.geom_bodyid == body).tolist():
            point = data.geom_xpos[geom] + data.geom_xmat[geom].reshape(3, 3) @ model.geom_aabb[geom, 3:]
            mujoco.mj_jac(model, data, jacobian, None, point, body)
            assert np.linalg.norm(jacobian @ data.qvel) <= allowed + 1e-9


def test_lever_of_joint_that_does_not_move_body_is_zero(model: mujoco.MjModel, boxes: BodyBoxes) -> None:
    levers = boxes.levers(model.body("upper").id)
    assert levers[0] == 1.0
    assert levers[1] > 0.5
    assert levers[2:].tolist() == [0.0] * (model.nv - 2)


def test_fixed_body_has_box_for_each_shape_if_it_is_large(model: mujoco.MjModel, boxes: BodyBoxes) -> None:
    fixed = boxes.fixed(1.0)
    gate, stone = (fixed[int(each)] for each in body_ids(model, "gate", "stone"))
    assert (len(gate), len(stone)) == (2, 1)
    assert len(boxes.fixed(5.0)[int(body_ids(model, "gate")[0])]) == 1
    assert gate.extents()[2] == pytest.approx([2.0, 2.0])


def test_box_of_level_floor_is_everything_below_it(model: mujoco.MjModel, boxes: BodyBoxes) -> None:
    sides = boxes.fixed(1.0)[0].sides[:, 0]
    assert -sides[5] == -2.0
    assert (sides[:5] <= -FAR).all()


def test_shape_that_touches_nothing_counts_for_no_box(model: mujoco.MjModel, boxes: BodyBoxes) -> None:
    assert boxes.radius[model.body("gate").id] < 1.5


def test_links_of_one_class_ignore_each_other_and_not_part(model: mujoco.MjModel, boxes: BodyBoxes) -> None:
    ids = body_ids(model, "slider", "fore", "part")
    nowhere = np.zeros((3, 9))
    around = boxes.at(ids, nowhere[:, :3], nowhere)
    assert around.ignore(around).tolist() == [[True, True, False], [True, True, False], [False, False, False]]


def test_box_around_boxes_contains_each_run(boxes: BodyBoxes, model: mujoco.MjModel) -> None:
    gate = boxes.fixed(1.0)[int(body_ids(model, "gate")[0])]
    whole = gate.around()
    assert (whole.sides[:, 0] == gate.sides.min(axis=1)).all()
    assert (gate.around([0, 1]).sides == gate.sides).all()


_NUMBERS = st.lists(st.floats(allow_nan=False), min_size=1, max_size=20)


@given(rows=_NUMBERS, columns=_NUMBERS)
def test_sums_are_rounded_as_additions_are(rows: list[float], columns: list[float]) -> None:
    left, right = np.ones((len(rows), 2)), np.ones((2, len(columns)))
    left[:, 0], right[1] = rows, columns
    with np.errstate(invalid="ignore", over="ignore"):
        np.testing.assert_array_equal(sums(left, right), np.add.outer(rows, columns))
