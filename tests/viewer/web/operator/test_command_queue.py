"""Command queue: requests of browsers become commands, and whatever holds the robot discards them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.operators.robot import Ask, MoveBase, MoveGrippers, MoveJoints, MoveTips, Now
from cellwright.util.pose import Pose
from cellwright.viewer.web.operator.command_queue import READ_ONLY, CommandQueue
from cellwright.viewer.web.operator.robot_state import Reach
from tests.viewer.web.operator.robots import Clock, number, seen, state

ME = 1
ELBOW, FINGER = number("right_3"), number("left_finger")
TIP = state().tips[0]
UP = Pose((0.0, 0.0, 0.1)) @ TIP


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def queue(clock: Clock) -> CommandQueue:
    queue = CommandQueue(seen(), clock)
    queue.see(state())
    return queue


def later(queue: CommandQueue, clock: Clock, seconds: float = 0.05, **changes: Any) -> None:
    clock.now += seconds
    queue.see(state(time=round(clock.now * 1e9), **changes))


def test_drag_sends_poses_for_both_arms(queue: CommandQueue) -> None:
    assert queue.due() == []
    assert queue.grab(0, ME, TIP)
    queue.drag(0, ME, UP)
    assert queue.wake.is_set()
    [order] = queue.due()
    assert isinstance(order, MoveTips)
    assert len(order.tips) == 2
    queue.release(0, ME)
    assert queue.due() == []


def test_slider_sends_one_joint(queue: CommandQueue, clock: Clock) -> None:
    assert queue.slide(ELBOW, -1.0)
    clock.now += 0.02
    [order] = queue.due()
    assert isinstance(order, MoveJoints)
    assert set(order.targets) == {"right_3"}


def test_gripper_and_base_requests_are_both_due(queue: CommandQueue) -> None:
    assert queue.grip(1, 0.5)
    queue.drive("left")
    grippers, base = queue.due()
    assert grippers == MoveGrippers((0.0, 0.5))
    assert isinstance(base, MoveBase)
    assert queue.due() == []


HOLDS = [{"is_stopped": True}, {"is_enabled": False}, {"is_homing": True}]


@pytest.mark.parametrize("held", HOLDS)
def test_queue_of_held_robot_refuses_requests(queue: CommandQueue, clock: Clock, held: dict[str, bool]) -> None:
    later(queue, clock, **held)
    assert not queue.grab(0, ME, TIP)
    assert not queue.slide(ELBOW, 0.0)
    assert not queue.grip(0, 1.0)
    queue.drive("left")
    queue.drag(0, ME, UP)
    assert queue.due() == []
    assert queue.notes.at(clock()).startswith("not sent: ")


@pytest.mark.parametrize("held", HOLDS)
def test_hold_of_robot_discards_requests(queue: CommandQueue, clock: Clock, held: dict[str, bool]) -> None:
    queue.grab(0, ME, TIP)
    queue.drag(0, ME, UP)
    queue.slide(FINGER, 0.04)
    later(queue, clock, **held)
    assert queue.notes.at(clock()).startswith("released: ")
    later(queue, clock)
    queue.drag(0, ME, UP)
    clock.now += 0.1
    assert queue.due() == [], "one has to let go, and take hold again"
    assert queue.grab(0, ME, TIP)


def test_stop_precedes_and_discards_all_requests(queue: CommandQueue, clock: Clock) -> None:
    queue.grab(0, ME, TIP)
    queue.drag(0, ME, UP)
    queue.slide(FINGER, 0.04)
    queue.grip(0, 1.0)
    queue.ask(Ask.ENABLE)
    queue.stop()
    assert queue.due() == [Now.STOP]
    assert queue.due() == [Now.STOP], "until it has got through"
    assert not queue.slide(ELBOW, 0.0)
    queue.sent(Now.STOP)
    assert queue.due() == []
    assert "EMERGENCY STOP" in queue.notes.at(clock())


def test_stop_is_kept_while_robot_is_disconnected(queue: CommandQueue, clock: Clock) -> None:
    queue.lose()
    queue.stop()
    assert queue.due() == [Now.STOP]
    assert CommandQueue(seen(), clock).due() == []


@pytest.mark.parametrize("ask", list(Ask))
def test_service_request_is_due_once_and_discards_moves(queue: CommandQueue, ask: Ask) -> None:
    queue.slide(FINGER, 0.04)
    queue.ask(ask)
    queue.ask(ask)
    assert queue.due() == [ask], "once, and what was wanted before is over"


def test_refusal_discards_requests_and_is_shown(queue: CommandQueue, clock: Clock) -> None:
    queue.grab(0, ME, TIP)
    queue.drag(0, ME, UP)
    queue.refused("/vr commands this topic")
    assert (queue.notes.at(clock()), queue.notes.is_bad) == ("refused: /vr commands this topic", True)
    assert set(queue.refused_poses) == {0}
    queue.drag(0, ME, UP)
    clock.now += 0.1
    assert queue.due() == []


def test_arm_sliders_are_refused_while_hand_is_held(queue: CommandQueue, clock: Clock) -> None:
    queue.slide(ELBOW, 1.0)
    queue.grab(1, ME, state().tips[1])
    clock.now += 0.1
    assert queue.due() == [], "the slider gives way to the hand"
    assert not queue.slide(ELBOW, 1.0)
    assert "release it first" in queue.notes.at(clock())
    assert queue.slide(FINGER, 0.04), "fingers are no arms"
    queue.release(1, ME)
    assert queue.slide(ELBOW, 1.0)


def test_reset_discards_requests(queue: CommandQueue, clock: Clock) -> None:
    later(queue, clock)
    queue.slide(ELBOW, 1.0)
    clock.now += 0.1
    queue.see(state(time=0))
    assert queue.due() == []


def test_queue_of_real_robot_accepts_stop_only(clock: Clock) -> None:
    queue = CommandQueue(replace(seen(), is_real=True), clock)
    queue.see(state())
    assert not queue.grab(0, ME, TIP)
    assert not queue.slide(ELBOW, 0.0)
    queue.ask(Ask.HOME)
    assert queue.due() == []
    assert queue.notes.at(clock()) == READ_ONLY
    queue.stop()
    assert queue.due() == [Now.STOP]


def test_hand_at_rest_short_of_target_is_out_of_reach(queue: CommandQueue, clock: Clock) -> None:
    later(queue, clock, 1.0, aims=(UP, None))
    found = [queue.reach]
    later(queue, clock, 1.0, aims=(UP, None))
    found.append(queue.reach)
    assert found == [(Reach.ON_ITS_WAY, Reach.THERE), (Reach.SHORT, Reach.THERE)]


def test_delay_of_robot_at_rest_is_measured(queue: CommandQueue, clock: Clock) -> None:
    later(queue, clock)
    later(queue, clock)
    queue.grab(0, ME, TIP)
    queue.drag(0, ME, UP)
    queue.due()
    later(queue, clock, 0.03)
    later(queue, clock, 0.01, tips=(UP, state().tips[1]))
    assert queue.delay.seconds == pytest.approx(0.04)


def test_delay_of_moving_robot_is_not_measured(queue: CommandQueue, clock: Clock) -> None:
    later(queue, clock, positions=tuple(0.5 for _ in state().positions))
    queue.slide(ELBOW, 1.0)
    later(queue, clock, positions=tuple(0.6 for _ in state().positions))
    assert queue.delay.seconds is None


ANYTHING: st.SearchStrategy[Callable[[CommandQueue], object]] = st.one_of(
    st.builds(lambda arm, browser: lambda queue: queue.grab(arm, browser, TIP), st.integers(-1, 3), st.integers(0, 1)),
    st.builds(
        lambda arm, x: lambda queue: queue.drag(arm, ME, Pose((x, 0.0, 0.0))),
        st.integers(-1, 3),
        st.floats() | st.floats(-1.0, 1.0),
    ),
    st.builds(lambda arm: lambda queue: queue.release(arm, ME), st.integers(-1, 3)),
    st.builds(lambda joint, x: lambda queue: queue.slide(joint, x), st.integers(-1, 20), st.floats()),
    st.builds(lambda side, x: lambda queue: queue.grip(side, x), st.integers(-1, 3), st.floats()),
    st.builds(lambda direction: lambda queue: queue.drive(direction), st.sampled_from(["left", "up"])),
    st.builds(lambda ask: lambda queue: queue.ask(ask), st.sampled_from(list(Ask))),
    st.just(lambda queue: queue.stop()),
    st.just(lambda queue: queue.refused("no")),
    st.just(lambda queue: queue.lose()),
    st.builds(lambda change: lambda queue: queue.see(state(**change)), st.sampled_from([{}, *HOLDS])),
)


@given(st.lists(ANYTHING, max_size=40))
def test_any_browser_actions_give_valid_commands(acts: list[Callable[[CommandQueue], object]]) -> None:
    clock = Clock()
    queue = CommandQueue(seen(), clock)
    for act in acts:
        act(queue)
        clock.now += 0.03
        orders = queue.due()
        if any(isinstance(order, MoveTips | MoveJoints | MoveGrippers | MoveBase) for order in orders):
            assert queue.state is not None
            assert queue.state.why_not == ""
        for order in orders:
            if isinstance(order, MoveTips):
                assert all(tip.is_finite() for tip in order.tips)
            elif isinstance(order, MoveJoints):
                for name, value in order.targets.items():
                    joint = seen().joints[number(name)]
                    assert joint.lower <= value <= joint.upper
            elif isinstance(order, MoveGrippers):
                assert all(0.0 <= closed <= 1.0 for closed in order.closed)
            elif order is Now.STOP:
                assert orders == [Now.STOP]
