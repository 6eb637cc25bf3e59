"""Command topics and services: effects and refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Mimic
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.standard import String
from cellwright.robot.commands import MAX_ENTRIES, NamedJoints
from cellwright.robot.safety import SafetySettings
from cellwright.util.errors import MessageError, RejectedCommandError
from tests.robot.robots import bare, fixed, two_arms
from tests.robot.talk import RESET, Talk


@pytest.fixture
def talk() -> Talk:
    return Talk()


@pytest.mark.parametrize("topic", ["joint_cmd", "target_joint_from_vr", "target_finger_joints"])
def test_commanded_joints_reach_targets_and_others_stay(topic: str, talk: Talk) -> None:
    talk.joints({"wrist_left": 0.4, "shoulder_right": -0.3}, topic)
    talk.seconds(1.0)
    assert talk.at("wrist_left") == pytest.approx(0.4, abs=1e-4)
    assert talk.at("shoulder_right") == pytest.approx(-0.3, abs=1e-4)
    assert talk.at("elbow_right") == pytest.approx(-1.0, abs=1e-3)
    assert (talk.node.commander.taken, talk.node.refused, talk.node.commander.ignored) == (1, 0, 0)


def test_later_message_keeps_targets_of_unnamed_joints(talk: Talk) -> None:
    talk.joints({"waist": 0.8})
    talk.seconds(0.1)
    talk.joints({"head": 0.2})
    talk.seconds(1.0)
    assert talk.at("waist") == pytest.approx(0.8, abs=1e-4)
    assert talk.at("head") == pytest.approx(0.2, abs=1e-4)


def test_unknown_names_are_ignored_and_reported_once(talk: Talk) -> None:
    for _ in range(100):
        talk.joints({"waist": 0.1, "no such joint": 1.0, "tip_left": 0.0, "antenna": 0.0, "thumb_left": 0.01})
        talk.seconds(0.1)
    assert talk.at("waist") == pytest.approx(0.1, abs=1e-4)
    assert talk.node.commander.notices.unknown == ["no such joint", "tip_left", "antenna"]
    assert len(talk.lines) == 2
    assert "thumb_left mimics finger_left" in talk.lines[0]
    assert "'no such joint' is not a joint of this robot, 'tip_left' is a fixed joint" in talk.lines[1]
    assert talk.node.refused == 0


def test_message_of_unknown_names_only_counts_as_ignored(talk: Talk) -> None:
    talk.joints({"unknown": 1.0})
    talk.joints({})
    assert (talk.node.commander.taken, talk.node.commander.ignored) == (0, 2)
    assert talk.node.commander.gate.commanders == ()


@pytest.mark.parametrize(
    ("names", "positions", "reason"),
    [
        (["waist", "head"], [0.5], "same length .got 2 and 1."),
        (["waist"], [0.5, 0.5], "same length .got 1 and 2."),
        (["waist", "head"], [0.5, math.nan], "the position of 'head' must be finite .got nan."),
        (["head", "waist"], [math.inf, 0.5], "the position of 'head' must be finite .got inf."),
        (["waist", "waist"], [0.5, 0.5], "'waist' appears twice"),
        (["waist", "x" * 10_000], [0.5, math.nan], "xxx"),
        ([f"joint{number}" for number in range(5000)], [0.0] * 5000, "at most 4096 entries are allowed .got 5000."),
    ],
)
def test_invalid_joint_command_is_refused_whole(
    names: list[str], positions: list[float], reason: str, talk: Talk
) -> None:
    with pytest.raises(RejectedCommandError, match=reason) as refusal:
        talk.state("joint_cmd", names, positions)
    assert len(str(refusal.value)) < 200
    talk.seconds(0.2)
    assert talk.at("waist") == pytest.approx(0.0, abs=1e-6)
    assert (talk.node.commander.taken, talk.node.refused) == (0, 1)


def test_duplicate_search_is_linear_in_message_length() -> None:
    class Name(str):
        """A name that counts its comparisons."""

        __slots__ = ()
        looks = 0

        def __eq__(self, other: object) -> bool:
            Name.looks += 1
            return str.__eq__(self, other)

        def __hash__(self) -> int:
            Name.looks += 1
            return str.__hash__(self)

    names = [Name(f"joint{number}") for number in range(MAX_ENTRIES)]
    with pytest.raises(RejectedCommandError, match="appears twice"):
        NamedJoints({}).read(joint_state([*names[:-1], Name(names[-2])], [0.0] * MAX_ENTRIES, time=0))
    assert MAX_ENTRIES <= Name.looks < 20 * MAX_ENTRIES  # a pass for each name would be MAX_ENTRIES**2


def test_list_of_names_is_read_again_after_a_change() -> None:
    named = NamedJoints({"waist": 4, "lift": 7})
    message = joint_state(["waist", "elsewhere", "lift"], [0.1, 0.2, 0.3], time=0)
    for _ in range(2):
        positions = named.read(message)
        assert positions[named.places].tolist() == [0.1, 0.3]
        assert named.joints.tolist() == [4, 7]
    message.name[:] = ["lift", "waist", "elsewhere"]  # in place, by its sender
    named.read(message)
    assert (named.joints.tolist(), named.places.tolist()) == ([7, 4], [0, 1])


def test_refused_list_of_names_stays_refused() -> None:
    named = NamedJoints({"waist": 4})
    message = joint_state(["waist", "waist"], [0.1, 0.2], time=0)
    for _ in range(2):
        with pytest.raises(RejectedCommandError, match="appears twice"):
            named.read(message)


def test_large_finite_positions_are_taken() -> None:
    assert len(NamedJoints({}).read(joint_state(["a", "b"], [1.7e308, 1.7e308], time=0))) == 2


@pytest.mark.parametrize("values", [(math.inf, -math.inf), (math.nan, 0.0), (0.0, -math.inf)])
def test_infinite_positions_are_refused(values: tuple[float, float]) -> None:
    with pytest.raises(RejectedCommandError, match="must be finite"):
        NamedJoints({}).read(joint_state(["a", "b"], values, time=0))


def test_message_of_another_type_is_refused(talk: Talk) -> None:
    with pytest.raises(MessageError):
        talk.node.bus.publish("/io_teleop/joint_cmd", String("waist"), node="/op")


def with_mimic_head(multiplier: float, offset: float) -> RobotConfig:
    """Return the robot of the tests with a head that mimics its right shoulder, which starts at 0.5 rad."""
    config = two_arms()
    mimic = Mimic("shoulder_right", multiplier, offset)
    joints = (replace(joint, mimic=mimic) if joint.name == "head" else joint for joint in config.robot.joints)
    return replace(config, robot=replace(config.robot, joints=tuple(joints)), head=None, head_axes=())


def test_mimic_joint_starts_at_position_of_its_leader() -> None:
    talk = Talk(with_mimic_head(-0.5, 0.3))
    applied = talk.listen("applied_joint_cmd")
    for _ in range(10):
        assert talk.at("head") == pytest.approx(0.05, abs=1e-6), "the mimic joint moves without a command"
        talk.steps(1)
    targets = dict(zip(applied[-1].name, applied[-1].position.tolist(), strict=True))
    assert targets["head"] == pytest.approx(0.05)


def test_mimic_joint_stays_within_its_own_limits() -> None:
    talk = Talk(with_mimic_head(2.0, 0.0))  # the head turns to 1.5 rad
    applied = talk.listen("applied_joint_cmd")
    talk.joints({"shoulder_right": 1.9})
    for _ in range(240):
        talk.steps(1)
        assert talk.at("head") < 1.5 + 0.01
    assert talk.at("shoulder_right") == pytest.approx(1.9, abs=1e-3)
    assert talk.at("head") == pytest.approx(1.5, abs=1e-3)
    targets = dict(zip(applied[-1].name, applied[-1].position.tolist(), strict=True))
    assert targets["head"] == 1.5
    talk.joints({"shoulder_right": 0.2})
    talk.seconds(1.5)
    assert talk.at("head") == pytest.approx(0.4, abs=1e-3)


def test_targets_beyond_limits_are_clipped_and_logged(talk: Talk) -> None:
    applied = talk.listen("applied_joint_cmd")
    for _ in range(50):
        talk.joints({"waist": 7.0, "lift": -1.0, "elbow_left": -2.0001})
        talk.steps(2)
    talk.seconds(1.0)
    assert talk.at("waist") == pytest.approx(1.0, abs=1e-4)
    assert talk.at("lift") == pytest.approx(0.0, abs=1e-4)
    assert len(talk.lines) == 1, "more than one line of a kind in a second"
    assert "waist to -1 .. 1 (got 7); lift to " in talk.lines[0]
    assert "elbow_left" not in talk.lines[0], "a rounded limit is logged"
    last = dict(zip(applied[-1].name, applied[-1].position.tolist(), strict=True))
    assert (last["waist"], last["lift"], last["elbow_left"]) == (1.0, 0.0, -2.0)


@given(st.dictionaries(st.sampled_from(sorted(two_arms().robot.joint_indices)), st.floats(allow_nan=False), max_size=6))
def test_applied_targets_are_always_within_limits(targets: dict[str, float]) -> None:
    if any(map(math.isinf, targets.values())):
        with pytest.raises(RejectedCommandError):
            SHARED.joints(targets)
    else:
        SHARED.joints(targets)
    SHARED.steps(2)
    commander = SHARED.node.commander
    assert (commander.limiter.lower <= commander.applied).all()
    assert (commander.applied <= commander.limiter.upper).all()


SHARED = Talk()


def test_hand_topic_takes_only_joints_below_wrist(talk: Talk) -> None:
    talk.joints({"finger_right": 0.03, "finger_left": 0.03, "shoulder_right": 1.0}, "joint_cmd_finger_right")
    talk.seconds(1.0)
    assert talk.at("finger_right") == pytest.approx(0.03, abs=1e-5)
    assert talk.at("thumb_right") == pytest.approx(0.03, abs=1e-4), "the mimic joint does not follow"
    assert talk.at("finger_left") == pytest.approx(0.0, abs=1e-5)
    assert talk.at("shoulder_right") == pytest.approx(0.5, abs=1e-3)
    assert "'finger_left' is not a joint of that hand" in talk.lines[0]
    talk.joints({"finger_left": 0.02}, "joint_cmd_finger_left")
    talk.seconds(0.5)
    assert talk.at("finger_left") == pytest.approx(0.02, abs=1e-5)


def test_gripper_statuses_move_right_then_left_gripper(talk: Talk) -> None:
    states = talk.listen("gripper_states")
    talk.grippers(1.0, 0.25)
    talk.seconds(1.0)
    assert talk.at("finger_right") == pytest.approx(0.04, abs=1e-5)
    assert talk.at("finger_left") == pytest.approx(0.01, abs=1e-5)
    assert states[-1].name == ["gripper_0", "gripper_1"]
    assert states[-1].position.tolist() == pytest.approx([1.0, 0.25], abs=1e-3)


def test_gripper_status_is_clipped_to_0_and_1(talk: Talk) -> None:
    talk.grippers(1.3, -0.2, 0.0)
    talk.seconds(1.0)
    assert talk.at("finger_right") == pytest.approx(0.04, abs=1e-5)
    assert talk.at("finger_left") == pytest.approx(0.0, abs=1e-5)
    assert any("clipped to 0 to 1 (got 1.3, -0.2" in line for line in talk.lines)
    assert any("3 numbers for 2 grippers" in line for line in talk.lines)


@pytest.mark.parametrize(
    ("statuses", "reason"), [([0.5], "2 numbers, one a gripper"), ([0.5, math.nan], "from 0 to 1 .got")]
)
def test_invalid_gripper_message_is_refused_whole(statuses: list[float], reason: str, talk: Talk) -> None:
    with pytest.raises(RejectedCommandError, match=reason):
        talk.grippers(*statuses)
    talk.seconds(0.2)
    assert talk.at("finger_right") == pytest.approx(0.0, abs=1e-6)


def test_plain_robot_has_no_gripper_topics_and_any_joint_as_finger() -> None:
    talk = Talk(bare(two_arms()))
    names = [info.name for info in talk.node.bus.topics()]
    assert "/io_teleop/target_gripper_status" not in names
    assert "/io_teleop/gripper_states" not in names
    talk.joints({"finger_left": 0.02}, "joint_cmd_finger_right")
    talk.seconds(0.5)
    assert talk.at("finger_left") == pytest.approx(0.02, abs=1e-5)


def test_disabled_robot_holds_and_counts_ignored_commands(talk: Talk) -> None:
    talk.joints({"waist": 1.0})
    talk.seconds(0.1)
    assert talk.enable(enabled=False).success
    held = talk.at("waist")
    talk.joints({"waist": -1.0})
    talk.grippers(1.0, 1.0)
    talk.base(0.0, 1.0)
    talk.seconds(0.5)
    assert abs(talk.at("waist") - held) < 0.02
    assert talk.node.commander.ignored == 3
    assert talk.reset().message.startswith("commands are disabled")
    assert talk.enable().success
    talk.joints({"waist": -0.5})
    talk.seconds(4.0)
    assert talk.at("waist") == pytest.approx(-0.5, abs=1e-4)


def test_each_reason_for_ignored_commands_is_logged_once() -> None:
    talk = Talk(safety=SafetySettings(start_disabled=True))
    for _ in range(20):
        talk.joints({"waist": 0.5})
        talk.seconds(0.2)
    (line,) = talk.lines
    assert line.startswith("ignoring /io_teleop/joint_cmd from /op: commands are disabled; ")
    talk.stop()
    talk.joints({"waist": 0.5})
    assert talk.lines[-1].endswith("the emergency stop is active; call /io_teleop/clear_emergency_stop to clear it")
    talk.clear()
    talk.enable()
    talk.joints({"waist": 0.5})
    talk.enable(enabled=False)
    talk.joints({"waist": 0.5})
    assert sum("commands are disabled; " in line for line in talk.lines) == 2


def test_invalid_command_is_refused_also_while_disabled(talk: Talk) -> None:
    talk.enable(enabled=False)
    with pytest.raises(RejectedCommandError):
        talk.state("joint_cmd", ["waist"], [math.nan])


def test_topics_and_services_have_published_names_and_types(talk: Talk) -> None:
    services = {info.name: info.type.name for info in talk.node.bus.services()}
    assert services == {
        RESET: "std_srvs/Trigger",
        "/io_teleop/set_enabled": "std_srvs/SetBool",
        "/io_teleop/clear_emergency_stop": "std_srvs/Trigger",
    }
    topics = {info.name for info in talk.node.bus.topics()}
    assert {"/io_teleop/joint_cmd", "/io_teleop/joint_states", "/io_teleop/target_base_move", "/clock"} <= topics
    assert "/io_teleop/target_base_move" not in {info.name for info in Talk(fixed(two_arms())).node.bus.topics()}
