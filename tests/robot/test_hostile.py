"""Hostile input: random messages of the right types, and invalid bytes. The node goes on."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.bus import Direction
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import floats
from cellwright.middleware.messages.standard import Bool, Header, JointState, Point, Pose, PoseArray, Quaternion, Time
from cellwright.middleware.messages.std_srvs import SetBoolRequest, TriggerRequest
from cellwright.middleware.wire.frames import Frame, FrameKind
from cellwright.robot.safety import SafetySettings
from cellwright.util.errors import CellwrightError
from tests.middleware.server.talk import served
from tests.robot.talk import PREFIX, RESET, Talk

NAMES = [*Talk().node.commander.numbers, "antenna", "tip_left", "", "no such joint", "\n\x00\x1b[2J", "ü" * 300]
NUMBERS = st.floats() | st.sampled_from([0.0, 1.0, -1.0, 1e300, -1e300, 5e-324])
STAMPS = st.builds(Time, st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1))
HEADERS = st.builds(Header, STAMPS, st.sampled_from(["", "base", "torso", "nowhere"]))
ARRAYS = st.lists(NUMBERS, max_size=8).map(floats)
JOINTS = st.builds(JointState, HEADERS, st.lists(st.sampled_from(NAMES), max_size=8), ARRAYS, ARRAYS, ARRAYS)
POSES = st.builds(
    PoseArray,
    HEADERS,
    st.lists(
        st.builds(
            Pose, st.builds(Point, NUMBERS, NUMBERS, NUMBERS), st.builds(Quaternion, NUMBERS, NUMBERS, NUMBERS, NUMBERS)
        ),
        max_size=3,
    ),
)
LAYOUT = TYPES.message("std_msgs/MultiArrayLayout")([], 0)  # type: ignore[call-arg]
MOVES = ARRAYS.map(lambda data: TYPES.message("std_msgs/Float64MultiArray")(LAYOUT, data))  # type: ignore[call-arg]
TOPICS = {
    **dict.fromkeys(("joint_cmd", "target_joint_from_vr", "target_finger_joints"), JOINTS),
    **dict.fromkeys(("joint_cmd_finger_left", "joint_cmd_finger_right", "target_gripper_status"), JOINTS),
    "target_ee_poses": POSES,
    "target_base_move": MOVES,
    "emergency_stop": st.builds(Bool, st.booleans()),
}
PUBLISHED = st.sampled_from(sorted(TOPICS)).flatmap(lambda topic: st.tuples(st.just(PREFIX + topic), TOPICS[topic]))
CALLED = st.sampled_from(
    [
        (RESET, TriggerRequest()),
        (PREFIX + "clear_emergency_stop", TriggerRequest()),
        (PREFIX + "set_enabled", SetBoolRequest(data=True)),
        (PREFIX + "set_enabled", SetBoolRequest(data=False)),
    ]
)

CAREFUL = SafetySettings(
    silence=0.01, max_speeds=(("*", 2.0),), start_guard=1.0, one_commander=0.02, max_age=1e6, clutch=True
)


@pytest.fixture(scope="module", params=[SafetySettings(), CAREFUL], ids=["plain", "careful"])
def talk(request: pytest.FixtureRequest) -> Talk:
    """A node, with a listener on each of its topics."""
    talk = Talk(safety=request.param, self_collision=True)
    for info in talk.node.bus.topics():
        if info.direction is Direction.OUT:
            talk.listen(info.name)
    return talk


@pytest.mark.slow
@given(st.lists(st.tuples(PUBLISHED | CALLED, st.sampled_from(["/a", "/b", ""])), max_size=6))
def test_random_messages_keep_targets_within_limits(talk: Talk, messages: list[tuple[tuple[str, Any], str]]) -> None:
    node = talk.node
    for (name, message), sender in messages:
        with suppress(CellwrightError):
            if message.__msgtype__.endswith("_Request"):
                node.bus.call(name, message, node=sender)
            else:
                node.bus.publish(name, message, node=sender)
        talk.steps()
    commander = node.commander
    assert (commander.limiter.lower <= commander.applied).all()
    assert (commander.applied <= commander.limiter.upper).all()
    assert np.isfinite(node.simulation.data.qpos).all()
    assert all("\n" not in line and len(line) < 500 for line in talk.lines), talk.lines
    talk.lines.clear()


def test_random_bytes_are_refused_without_closing_connection() -> None:
    talk = Talk()
    draw = np.random.default_rng(0)
    with served(talk.node) as hall:
        client = hall.connect()
        for number in range(1, 300):
            topic = PREFIX + str(draw.choice(sorted(TOPICS)))
            frame = Frame(FrameKind.PUBLISH, number, topic, payload=draw.bytes(int(draw.integers(0, 200))))
            assert client.ask(frame).kind in (FrameKind.DONE, FrameKind.REFUSED)
            talk.steps()
        assert len(hall.server.clients) == 1
    assert talk.node.refused > 200
    assert np.isfinite(talk.node.simulation.data.qpos).all()
