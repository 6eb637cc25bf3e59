"""Command queue: requests of browsers become commands, and whatever holds the robot discards them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.operators.robot import Ask, MoveBase, MoveGrippers, MoveJoints, MoveTips, Now
from cellwright.util.pose import Pose
from cellwright.viewer.web.operator.command_queue import READ_ONLY, Desk
from cellwright.viewer.web.operator.robot_state import Reach
from tests.viewer.web.operator.robots import Clock, number, seen, standing

ME = 1
ELBOW, FINGER = number("right_3"), number("left_finger")
TIP = standing().tips[0]
UP = Pose((0.0, 0.0, 0.1)) @ TIP


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def desk(clock: Clock) -> Desk:
    desk = Desk(seen(), clock)
    desk.see(standing())
    return desk


def later(desk: Desk, clock: Clock, seconds: float = 0.05, **changes: Any) -> None:
    clock.now += seconds
    desk.see(standing(time=round(clock.now * 1e9), **changes))


def test_a_drag_is_poses_for_both_arms(desk: Desk) -> None:
    assert desk.due() == []
    assert desk.grab(0, ME, TIP)
    desk.drag(0, ME, UP)
    assert desk.wake.is_set()
    [order] = desk.due()
    assert isinstance(order, MoveTips)
    assert len(order.tips) == 2
    desk.release(0, ME)
    assert desk.due() == []


def test_a_slider_is_one_joint(desk: Desk, clock: Clock) -> None:
    assert desk.slide(ELBOW, -1.0)
    clock.now += 0.02
    [order] = desk.due()
    assert isinstance(order, MoveJoints)
    assert set(order.targets) == {"right_3"}


def test_a_gripper_and_the_base(desk: Desk) -> None:
    assert desk.grip(1, 0.5)
    desk.drive("left")
    grippers, base = desk.due()
    assert grippers == MoveGrippers((0.0, 0.5))
    assert isinstance(base, MoveBase)
    assert desk.due() == []


HOLDS = [{"is_stopped": True}, {"is_enabled": False}, {"is_homing": True}]


@pytest.mark.parametrize("held", HOLDS)
def test_nothing_is_sent_to_a_robot_that_takes_no_commands(desk: Desk, clock: Clock, held: dict[str, bool]) -> None:
    later(desk, clock, **held)
    assert not desk.grab(0, ME, TIP)
    assert not desk.slide(ELBOW, 0.0)
    assert not desk.grip(0, 1.0)
    desk.drive("left")
    desk.drag(0, ME, UP)
    assert desk.due() == []
    assert desk.notes.at(clock()).startswith("not sent: it")


@pytest.mark.parametrize("held", HOLDS)
def test_whatever_holds_the_robot_ends_all_that_was_wanted(desk: Desk, clock: Clock, held: dict[str, bool]) -> None:
    desk.grab(0, ME, TIP)
    desk.drag(0, ME, UP)
    desk.slide(FINGER, 0.04)
    later(desk, clock, **held)
    assert desk.notes.at(clock()).startswith("let go: it")
    later(desk, clock)
    desk.drag(0, ME, UP)
    clock.now += 0.1
    assert desk.due() == [], "one has to let go, and take hold again"
    assert desk.grab(0, ME, TIP)


def test_a_stop_comes_before_all_and_forgets_all(desk: Desk, clock: Clock) -> None:
    desk.grab(0, ME, TIP)
    desk.drag(0, ME, UP)
    desk.slide(FINGER, 0.04)
    desk.grip(0, 1.0)
    desk.ask(Ask.ENABLE)
    desk.stop()
    assert desk.due() == [Now.STOP]
    assert desk.due() == [Now.STOP], "until it has got through"
    assert not desk.slide(ELBOW, 0.0)
    desk.sent(Now.STOP)
    assert desk.due() == []
    assert "EMERGENCY STOP" in desk.notes.at(clock())


def test_a_stop_is_kept_while_nobody_is_there(desk: Desk, clock: Clock) -> None:
    desk.lose()
    desk.stop()
    assert desk.due() == [Now.STOP]
    assert Desk(seen(), clock).due() == []


@pytest.mark.parametrize("ask", list(Ask))
def test_services(desk: Desk, ask: Ask) -> None:
    desk.slide(FINGER, 0.04)
    desk.ask(ask)
    desk.ask(ask)
    assert desk.due() == [ask], "once, and what was wanted before is over"


def test_a_refusal_ends_what_was_wanted_and_is_told(desk: Desk, clock: Clock) -> None:
    desk.grab(0, ME, TIP)
    desk.drag(0, ME, UP)
    desk.refused("/vr commands here")
    assert (desk.notes.at(clock()), desk.notes.is_bad) == ("refused: /vr commands here", True)
    assert set(desk.spurned) == {0}
    desk.drag(0, ME, UP)
    clock.now += 0.1
    assert desk.due() == []


def test_sliders_of_arms_wait_until_the_hand_is_let_go_of(desk: Desk, clock: Clock) -> None:
    desk.slide(ELBOW, 1.0)
    desk.grab(1, ME, standing().tips[1])
    clock.now += 0.1
    assert desk.due() == [], "the slider gives way to the hand"
    assert not desk.slide(ELBOW, 1.0)
    assert "let go of the hand" in desk.notes.at(clock())
    assert desk.slide(FINGER, 0.04), "fingers are no arms"
    desk.release(1, ME)
    assert desk.slide(ELBOW, 1.0)


def test_a_run_that_begins_anew_ends_what_was_wanted(desk: Desk, clock: Clock) -> None:
    later(desk, clock)
    desk.slide(ELBOW, 1.0)
    clock.now += 0.1
    desk.see(standing(time=0))
    assert desk.due() == []


def test_a_real_robot_is_shown_and_stopped_and_no_more(clock: Clock) -> None:
    desk = Desk(replace(seen(), is_real=True), clock)
    desk.see(standing())
    assert not desk.grab(0, ME, TIP)
    assert not desk.slide(ELBOW, 0.0)
    desk.ask(Ask.HOME)
    assert desk.due() == []
    assert desk.notes.at(clock()) == READ_ONLY
    desk.stop()
    assert desk.due() == [Now.STOP]


def test_a_hand_that_cannot_get_there(desk: Desk, clock: Clock) -> None:
    later(desk, clock, 1.0, aims=(UP, None))
    found = [desk.reach]
    later(desk, clock, 1.0, aims=(UP, None))
    found.append(desk.reach)
    assert found == [(Reach.ON_ITS_WAY, Reach.THERE), (Reach.SHORT, Reach.THERE)]


def test_the_delay_of_a_robot_at_rest(desk: Desk, clock: Clock) -> None:
    later(desk, clock)
    later(desk, clock)
    desk.grab(0, ME, TIP)
    desk.drag(0, ME, UP)
    desk.due()
    later(desk, clock, 0.03)
    later(desk, clock, 0.01, tips=(UP, standing().tips[1]))
    assert desk.delay.seconds == pytest.approx(0.04)


def test_the_delay_of_a_robot_that_moves_anyway_is_not_told(desk: Desk, clock: Clock) -> None:
    later(desk, clock, positions=tuple(0.5 for _ in standing().positions))
    desk.slide(ELBOW, 1.0)
    later(desk, clock, positions=tuple(0.6 for _ in standing().positions))
    assert desk.delay.seconds is None


ANYTHING: st.SearchStrategy[Callable[[Desk], object]] = st.one_of(
    st.builds(lambda arm, browser: lambda desk: desk.grab(arm, browser, TIP), st.integers(-1, 3), st.integers(0, 1)),
    st.builds(
        lambda arm, x: lambda desk: desk.drag(arm, ME, Pose((x, 0.0, 0.0))),
        st.integers(-1, 3),
        st.floats() | st.floats(-1.0, 1.0),
    ),
    st.builds(lambda arm: lambda desk: desk.release(arm, ME), st.integers(-1, 3)),
    st.builds(lambda joint, x: lambda desk: desk.slide(joint, x), st.integers(-1, 20), st.floats()),
    st.builds(lambda side, x: lambda desk: desk.grip(side, x), st.integers(-1, 3), st.floats()),
    st.builds(lambda direction: lambda desk: desk.drive(direction), st.sampled_from(["left", "up"])),
    st.builds(lambda ask: lambda desk: desk.ask(ask), st.sampled_from(list(Ask))),
    st.just(lambda desk: desk.stop()),
    st.just(lambda desk: desk.refused("no")),
    st.just(lambda desk: desk.lose()),
    st.builds(lambda change: lambda desk: desk.see(standing(**change)), st.sampled_from([{}, *HOLDS])),
)


@given(st.lists(ANYTHING, max_size=40))
def test_whatever_browsers_do_orders_make_sense(acts: list[Callable[[Desk], object]]) -> None:
    clock = Clock()
    desk = Desk(seen(), clock)
    for act in acts:
        act(desk)
        clock.now += 0.03
        orders = desk.due()
        if any(isinstance(order, MoveTips | MoveJoints | MoveGrippers | MoveBase) for order in orders):
            assert desk.standing is not None
            assert desk.standing.why_not == ""
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
