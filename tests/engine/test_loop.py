"""The loop: by the wall clock, in lockstep, and while a client waits for an answer."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.engine import loop as loops
from cellwright.engine.loop import SimulationLoop, StopCondition
from cellwright.engine.rate_control import RateControl, RealTimePacer
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.middleware.wire.frames import Frame, FrameKind, advance, read_time
from tests.middleware.server.talk import Hall, Talker, served
from tests.robot.talk import RESET, Talk
from tests.support.waiting import wait_until

SECOND = 1_000_000_000
CALL = Frame(FrameKind.CALL, 7, RESET, payload=TYPES.to_cdr(TriggerRequest()))


def run_until(loop: SimulationLoop, deadline: int) -> None:
    """Let time pass up to a time [ns]."""
    loop.stop = StopCondition(deadline)
    loop.run()


def moved_robot() -> Talk:
    """Return a node whose robot is away from home."""
    talk = Talk()
    talk.joints({"waist": 0.9})
    talk.seconds(0.6)
    return talk


def answer(client: Talker, number: int) -> Frame | None:
    """Return the answer to a client's request so far, or None."""
    client.listen()
    return next(
        (frame for frame in client.heard if frame.number == number and frame.kind is not FrameKind.MESSAGE), None
    )


def wait_for_answer(client: Talker, number: int) -> Frame:
    """Wait for an answer that is on its way to a client, or still at the server when the loop has ended."""
    client.wait_until(lambda: answer(client, number) is not None)
    found = answer(client, number)
    assert found is not None
    return found


def call_home(talk: Talk, client: Talker) -> None:
    """Send the call, and wait until the robot has it: the loop may step for long before it looks at its sockets."""
    taken: list[object] = []
    talk.node.bus.on_input.append(taken.append)
    client.say(CALL)
    client.wait_until(lambda: bool(taken))
    talk.node.bus.on_input.remove(taken.append)


class Wall:
    """Clock that moves only while the server waits, independent of the machine's speed."""

    def __init__(self, hall: Hall) -> None:
        self.time = 0.0
        self._wait = hall.server.wait

    def perf_counter(self) -> float:
        return self.time

    def wait(self, seconds: float, *, until_request: bool = True) -> bool:
        """Replacement of the server's `wait`."""
        is_busy = self._wait(0.0, until_request=until_request)
        self.time += seconds
        return is_busy


def test_loop_follows_wall_clock_and_serves_clients(monkeypatch: pytest.MonkeyPatch) -> None:
    talk, polls = Talk(), list[float]()
    with served(talk.node) as hall:
        client = hall.connect()
        wall = Wall(hall)
        client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/io_teleop/joint_states"))
        monkeypatch.setattr(hall.server, "wait", wall.wait)
        monkeypatch.setattr(loops, "time", wall)
        loop = SimulationLoop(talk.node.simulation, hall.server, on_poll=lambda: polls.append(wall.time))
        loop.pacer = RealTimePacer(talk.node.simulation, loop.rate, clock=wall.perf_counter, sleep=loop._serve)
        run_until(loop, SECOND // 2)
        assert wall.time == pytest.approx(0.5, abs=0.01), "the loop does not follow the wall clock"
        assert loop.pacer.factor == pytest.approx(1.0)
        client.wait_until(lambda: len(client.messages(5)) >= 45)
    assert polls == pytest.approx([0.1, 0.2, 0.3, 0.4], abs=0.02), "not polled ten times a second"


def test_stop_request_ends_loop_before_next_tick() -> None:
    talk = Talk()
    with served(talk.node) as hall:
        loop = SimulationLoop(talk.node.simulation, hall.server, rate=None)

        watch = talk.node.simulation.watch(
            "tenth", Fraction(10) * talk.node.simulation.clock.timestep, lambda _: stop()
        )

        def stop() -> None:
            loop.stop.request()
            watch.cancel()

        loop.run()
    assert talk.node.simulation.clock.tick == 10


def test_pending_response_delays_no_other_client() -> None:
    talk = moved_robot()
    with served(talk.node) as hall:
        waiting, other = hall.connect("/waiting"), hall.connect("/other")
        call_home(talk, waiting)
        loop = SimulationLoop(talk.node.simulation, hall.server, rate=None)
        started = talk.node.simulation.now
        run_until(loop, started + SECOND // 10)
        assert answer(waiting, 7) is None
        message = TYPES.to_cdr(joint_state(["waist"], [0.5], time=0))
        assert other.ask(Frame(FrameKind.PUBLISH, 3, "/io_teleop/joint_cmd", payload=message)).kind is FrameKind.DONE
        run_until(loop, started + 2 * SECOND)
        found = wait_for_answer(waiting, 7)
        assert TYPES.from_cdr(found.payload, TriggerResponse).success
    assert talk.node.commander.ignored == 1
    assert talk.at("waist") == pytest.approx(0.0, abs=1e-3)


def test_client_that_leaves_before_response_does_not_stop_loop() -> None:
    talk = moved_robot()
    with served(talk.node) as hall:
        gone, other = hall.connect("/gone"), hall.connect("/other")
        call_home(talk, gone)
        loop = SimulationLoop(talk.node.simulation, hall.server, rate=None)
        started = talk.node.simulation.now
        run_until(loop, started + SECOND // 10)
        gone.connection.close()
        call_home(talk, other)
        run_until(loop, started + 2 * SECOND)
        found = wait_for_answer(other, 7)
        assert TYPES.from_cdr(found.payload, TriggerResponse).success
    assert talk.node.simulation.now >= started + 2 * SECOND


def test_lockstep_advances_on_request_and_answers() -> None:
    talk = moved_robot()
    started = talk.node.simulation.now
    with served(talk.node, lockstep=True) as hall:
        client = hall.connect()
        client.say(CALL, advance(8, started + SECOND // 10, each_tick=False))
        loop = SimulationLoop(talk.node.simulation, hall.server, rate=None, timeout=0.05)
        run_until(loop, started + SECOND // 10)
        granted = wait_for_answer(client, 8)
        assert read_time(granted) == started + SECOND // 10
        pending = wait_for_answer(client, 7)
        assert pending.kind is FrameKind.DONE
        client.heard.remove(pending)
        assert answer(client, 7) is None
        client.say(advance(9, started + 3 * SECOND, each_tick=False))
        run_until(loop, started + 2 * SECOND)
        found = wait_for_answer(client, 7)
        assert TYPES.from_cdr(found.payload, TriggerResponse).success


def test_lockstep_stops_in_tick_of_message_to_client() -> None:
    talk = Talk()
    with served(talk.node, lockstep=True) as hall:
        client = hall.connect()
        client.say(Frame(FrameKind.SUBSCRIBE, 5, "/io_teleop/joint_states"), advance(8, SECOND, each_tick=False))
        loop = SimulationLoop(talk.node.simulation, hall.server, rate=None, on_poll=lambda: stop_after_the_answer())

        def stop_after_the_answer() -> None:
            if answer(client, 8) is not None:
                loop.stop.request()  # not earlier, even on a slow machine

        run_until(loop, SECOND)
        granted = wait_for_answer(client, 8)
        assert read_time(granted) == 12_500_000
        client.wait_until(lambda: len(client.messages(5)) == 1)


def test_closing_node_answers_waiting_clients() -> None:
    talk = moved_robot()
    with served(talk.node) as hall:
        client = hall.connect()
        client.say(CALL)
        client.ask(
            Frame(FrameKind.SUBSCRIBE, 5, "/io_teleop/joint_states")
        )  # its answer shows that the call has arrived
        talk.node.close()
        hall.server.close("the node has stopped")
        wait_until(lambda: client.is_over, "end of the connection", seen=lambda: client.heard, between=client.listen)
        found, ended = client.heard
        assert TYPES.from_cdr(found.payload, TriggerResponse).message == "the node has stopped"
        assert ended.kind is FrameKind.ENDED


def test_paused_loop_serves_clients_and_single_steps() -> None:
    talk = Talk()
    with served(talk.node) as hall:
        client = hall.connect()
        client.say(Frame(FrameKind.SUBSCRIBE, 5, "/io_teleop/joint_states"))
        tempo, ticks, polls = RateControl(None, paused=True), list[int](), 0

        def poll() -> None:
            nonlocal polls
            polls += 1
            ticks.append(talk.node.simulation.clock.tick)
            if polls == 2:
                tempo.step(3)
            if ticks[-2:] == [3, 3] or ticks[-1] > 3:
                loop.stop.request()

        loop = SimulationLoop(talk.node.simulation, hall.server, rate=tempo, on_poll=poll)
        run_until(loop, SECOND)
        wait_for_answer(client, 5)
    assert ticks[:2] == [0, 0]
    assert talk.node.simulation.clock.tick == 3


def test_lockstep_pause_delays_advance_requests() -> None:
    talk = Talk()
    with served(talk.node, lockstep=True) as hall:
        client, tempo, polls = hall.connect(), RateControl(None, paused=True), 0

        def poll() -> None:
            nonlocal polls
            polls += 1
            if polls == 2:
                assert answer(client, 8) is None
                tempo.resume()

        client.say(advance(8, SECOND // 10, each_tick=False))
        loop = SimulationLoop(talk.node.simulation, hall.server, rate=tempo, on_poll=poll, timeout=0.05)
        run_until(loop, SECOND // 10)
        granted = wait_for_answer(client, 8)
        assert read_time(granted) == SECOND // 10
    assert polls >= 2


@given(st.lists(st.sampled_from(["pause", "step", "fast", "max"]), max_size=6))
@settings(max_examples=8, deadline=None)
def test_changed_rate_keeps_state_hash(changes: list[str]) -> None:
    def hash_of(tempo: RateControl, on_poll: Callable[[], None]) -> str:
        talk = moved_robot()
        with served(talk.node) as hall:
            end = talk.node.simulation.now + SECOND // 10
            SimulationLoop(
                talk.node.simulation, hall.server, rate=tempo, on_poll=on_poll, stop=StopCondition(end)
            ).run()
        return talk.node.simulation.state_hash()

    tempo, left = RateControl(50.0), list(changes)
    acts: dict[str, Callable[[], None]] = {
        "pause": tempo.pause,
        "step": lambda: tempo.step(5),
        "fast": lambda: tempo.set_speed(20.0),
        "max": lambda: tempo.set_speed(None),
    }

    def change() -> None:
        acts[left.pop()]() if left else tempo.resume()

    assert hash_of(tempo, change) == hash_of(RateControl(), lambda: None)


class Service:
    """Service without sockets, whose clients are busy or not."""

    lockstep, advance_request, is_client_behind = False, None, False

    def __init__(self) -> None:
        self.is_busy = False
        self.waits = 0

    def wait(self, seconds: float, *, until_request: bool = True) -> bool:
        self.waits += 1
        return self.is_busy

    def hold_time(self) -> bool:
        return False

    def answer(self, request: object, refused: BaseException | None = None) -> None:
        raise AssertionError(request, refused)


class TickingClock:
    """Clock on which each reading takes 0.4 ms."""

    def __init__(self) -> None:
        self.time = 0.0

    def perf_counter(self) -> float:
        self.time += 0.0004
        return self.time


def test_free_loop_serves_idle_clients_less_often_until_they_are_busy(monkeypatch: pytest.MonkeyPatch) -> None:
    service = Service()
    monkeypatch.setattr(loops, "time", TickingClock())
    loop = SimulationLoop(Talk().node.simulation, service, rate=None)
    counts = []
    for is_busy in (True, False, True):
        service.is_busy, service.waits = is_busy, 0
        for _ in range(400):
            loop.tick()
        counts.append(service.waits)
    first, idle, again = counts
    assert 0 < 4 * idle < first
    assert again > 0.9 * first
