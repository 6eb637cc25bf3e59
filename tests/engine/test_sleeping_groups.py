"""Groups of sleeping bodies: who opens with whom."""

import mujoco
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.bounding_boxes import BodyBoxes
from cellwright.engine.sleeping_groups import Groups, SleepingGroups, least_linked, rotations

MODEL = """
<mujoco>
  <worldbody>
    <body name="table" pos="0 0 .5"><geom type="box" size=".4 .4 .05"/></body>
    <body name="other table" pos="1 0 .5"><geom type="box" size=".4 .4 .05"/></body>
    <body name="cart" pos="3 0 .5"><joint type="slide" axis="1 0 0"/><geom type="box" size=".2 .2 .05"/></body>
    <body name="low" pos="0 0 .6"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
    <body name="high" pos="0 0 .7"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
    <body name="bridge" pos=".5 0 .6"><freejoint/><geom type="box" size=".2 .05 .05"/></body>
    <body name="load" pos="3 0 .6"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
  </worldbody>
</mujoco>
"""


class Sleepers:
    """A small model, and the groups of what sleeps in it."""

    def __init__(self) -> None:
        self.model = mujoco.MjModel.from_xml_string(MODEL)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        parts = np.array([self.model.body(name).id for name in ("low", "high", "bridge", "load")], dtype=np.int64)
        cart = self.model.body("cart")
        self.groups = SleepingGroups(
            self.model, BodyBoxes(self.model), parts, {int(self.model.body_treeid[cart.id]): [cart.id]}
        )

    def find(self, *awake: str) -> Groups:
        is_awake = np.zeros(self.model.ntree, dtype=np.bool_)
        is_awake[[int(self.model.body_treeid[self.model.body(name).id]) for name in awake]] = True
        return self.groups.find(self.data, is_awake)

    def names(self, *awake: str) -> set[frozenset[str]]:
        groups = self.find(*awake)
        return {
            frozenset(self.model.body(body).name for body in groups.members(k).tolist())
            for k in range(len(groups.first))
        }


def test_group_is_what_may_touch_directly_or_not() -> None:
    assert Sleepers().names() == {
        frozenset({"table", "other table", "bridge", "low", "high"}),
        frozenset({"cart", "load"}),
    }


def test_waking_part_leaves_its_group() -> None:
    sleepers = Sleepers()
    sleepers.names()
    assert sleepers.names("bridge") == {
        frozenset({"table", "low", "high"}),
        frozenset({"other table"}),
        frozenset({"cart", "load"}),
    }
    assert len(sleepers.names()) == 2


def test_mechanism_that_moves_is_in_no_group() -> None:
    sleepers = Sleepers()
    assert frozenset({"load"}) in sleepers.names("cart")
    assert sleepers.find("cart").of_body[sleepers.model.body("cart").id] == -1


def test_boxes_of_group_contain_its_parts() -> None:
    sleepers = Sleepers()
    groups = sleepers.find("bridge")
    group = int(groups.of_body[sleepers.model.body("high").id])
    own = groups.boxes.some(groups.of_box == group)
    assert (own.sides.min(axis=1)[[2, 5]] == [0.45, -0.75]).all()
    assert groups.first_box[group] == np.flatnonzero(groups.of_box == group)[0]


def test_part_that_moved_while_awake_is_found_where_it_sleeps_now() -> None:
    sleepers = Sleepers()
    sleepers.names()
    sleepers.names("load")
    address = int(sleepers.model.jnt_qposadr[sleepers.model.body_jntadr[sleepers.model.body("load").id]])
    sleepers.data.qpos[address : address + 3] = 1.0, 0.2, 0.6
    assert frozenset({"cart"}) in sleepers.names()


@given(pairs=st.lists(st.tuples(st.integers(0, 19), st.integers(0, 19)), max_size=40))
def test_least_linked_is_same_for_linked_numbers_only(pairs: list[tuple[int, int]]) -> None:
    sets = [{number} for number in range(20)]
    for one, other in pairs:
        merged = sets[one] | sets[other]
        for number in merged:
            sets[number] = merged
    found = least_linked(20, np.array(pairs, dtype=np.int64).reshape(-1, 2))
    assert found.tolist() == [min(each) for each in sets]


@given(values=st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda each: sum(x * x for x in each) > 0.01))
def test_rotations_are_those_of_engine(values: list[float]) -> None:
    quaternion = np.array(values)
    expected = np.empty(9)
    mujoco.mju_quat2Mat(expected, quaternion / np.linalg.norm(quaternion))
    assert np.allclose(rotations(quaternion[None])[0], expected, atol=1e-12)
