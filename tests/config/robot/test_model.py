"""Tree of a robot: indices, names, paths through it."""

import pytest

from cellwright.config.robot.model import ROOT, Joint, JointType
from cellwright.util.errors import UnknownNameError
from tests.cell.model.robots import of_joints

ROBOT = of_joints(
    Joint("mount", JointType.FIXED, "base", "torso"),
    Joint("shoulder", JointType.REVOLUTE, "torso", "arm"),
    Joint("wrist", JointType.SPHERICAL, "arm", "hand"),
    Joint("lift", JointType.PRISMATIC, "base", "plate"),
    Joint("wheel", JointType.CONTINUOUS, "base", "tyre"),
    Joint("slab", JointType.PLANAR, "base", "puck"),
).robot


def test_links_have_index_of_joint_above() -> None:
    assert ROBOT.joint_indices == {"mount": 0, "shoulder": 1, "wrist": 2, "lift": 3, "wheel": 4, "slab": 5}
    assert ROBOT.link_indices == {"base": ROOT, "torso": 0, "arm": 1, "hand": 2, "plate": 3, "tyre": 4, "puck": 5}
    for link, index in ROBOT.link_indices.items():
        assert ROBOT.link_at(index) == link


def test_movable_and_driven_joints_are_selected_by_type() -> None:
    assert [joint.name for joint in ROBOT.movable] == ["shoulder", "wrist", "lift", "wheel", "slab"]
    assert [joint.name for joint in ROBOT.driven] == ["shoulder", "lift", "wheel"]


def test_chain_and_joint_above_follow_tree() -> None:
    assert [joint.name for joint in ROBOT.chain("hand")] == ["mount", "shoulder", "wrist"]
    assert ROBOT.chain("base") == ()
    above = ROBOT.joint_above("plate")
    assert above is not None
    assert above.name == "lift"
    assert ROBOT.joint_above("base") is None


def test_unknown_joint_name_is_refused_with_suggestion() -> None:
    assert ROBOT.joint("lift").child == "plate"
    with pytest.raises(UnknownNameError, match="unknown joint 'lifd'; did you mean lift"):
        ROBOT.joint("lifd")
