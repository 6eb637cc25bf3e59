from collections.abc import Callable

import pytest

from cellwright.cell.cell import Cell
from cellwright.engine.sensor import Reading
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import Bus
from cellwright.middleware.interface.binding import Output
from cellwright.middleware.interface.table import ALWAYS, Timing, publishes
from cellwright.middleware.messages import Message
from cellwright.middleware.messages.standard import Float64
from tests.support.cells import BARE


class Bench:
    """Bus, simulation, and the messages that were built."""

    def __init__(self, rate: int | Timing, *, latch: bool = False) -> None:
        self.simulation: Simulation = Cell(BARE).simulation
        self.bus = Bus(lambda: self.simulation.now)
        row = publishes("/probe", "std_msgs/Float64", rate, ALWAYS, "Time.", node="/node", latch=latch)
        self.output = Output(self.bus, self.simulation, row)
        self.built: list[float] = []
        self.heard: list[float] = []
        self.silent = False

    def build(self) -> Message | None:
        if self.silent:
            return None
        self.built.append(self.simulation.time)
        return Float64(self.simulation.time)

    def hear(self, message: Float64) -> None:
        self.heard.append(message.data)

    def steps(self, count: int) -> None:
        for _ in range(count):
            self.simulation.step()


def test_sampled_message_is_built_for_listeners_only() -> None:
    bench = Bench(100)
    bench.output.sample(bench.build)
    bench.steps(10)
    assert bench.built == []
    first = bench.bus.subscribe("/probe", bench.hear)
    second = bench.bus.subscribe("/probe", bench.hear)
    bench.steps(10)
    assert bench.built == [0.03, 0.04]
    assert bench.heard == [0.03, 0.03, 0.04, 0.04]
    first.cancel()
    bench.steps(5)
    assert bench.built == [0.03, 0.04, 0.05]
    second.cancel()
    bench.steps(10)
    assert len(bench.built) == 3
    assert bench.simulation.watches.next_due > 10**18


def test_each_step_topic_is_sampled_in_every_step() -> None:
    bench = Bench(Timing.EACH_STEP)
    bench.output.sample(bench.build)
    bench.bus.subscribe("/probe", bench.hear)
    bench.steps(3)
    assert bench.heard == [0.002, 0.004, 0.006]


def test_subscriber_before_sampling_gets_samples() -> None:
    bench = Bench(100)
    bench.bus.subscribe("/probe", bench.hear)
    bench.output.sample(bench.build)
    bench.steps(5)
    assert bench.heard == [0.01]


def test_sampled_message_is_published_early_on_request_and_skipped_if_none() -> None:
    bench = Bench(100)
    sampled = bench.output.sample(bench.build)
    sampled.publish()
    assert bench.built == []
    bench.bus.subscribe("/probe", bench.hear)
    bench.steps(1)
    sampled.publish()
    assert bench.heard == [0.002]
    bench.silent = True
    sampled.publish()
    bench.steps(10)
    assert bench.heard == [0.002]


@pytest.mark.parametrize("others", [0, 1])
def test_late_subscriber_of_latched_topic_gets_newest_sample(others: int) -> None:
    bench = Bench(100, latch=True)
    bench.output.sample(bench.build)
    for _ in range(others):
        bench.bus.subscribe("/probe", lambda _: None)
    bench.steps(7)
    bench.bus.subscribe("/probe", bench.hear).cancel()
    bench.steps(20)
    bench.bus.subscribe("/probe", bench.hear)
    assert bench.heard == [0.01, 0.05]


def test_stream_has_one_source_listener_while_subscribed() -> None:
    bench = Bench(10)
    events: list[str] = []
    taps: list[Callable[[Reading], None]] = []

    def listen(take: Callable[[Reading], None]) -> Callable[[], None]:
        events.append("listen")
        taps.append(take)
        return lambda: events.append("leave")

    bench.output.stream(listen, lambda reading: Float64(float(reading.sample)) if reading.sample else None)
    assert events == []
    both = [bench.bus.subscribe("/probe", bench.hear) for _ in range(2)]
    for sample in (0, 1):
        taps[0](Reading(time_ns=1, sample=sample))
    assert bench.heard == [1.0, 1.0]
    both[0].cancel()
    assert events == ["listen"]
    both[1].cancel()
    assert events == ["listen", "leave"]
    bench.bus.subscribe("/probe", bench.hear)
    assert events == ["listen", "leave", "listen"]


@pytest.mark.parametrize(("rate", "text"), [(50, "50 Hz"), (Timing.ON_EVENT, "on event")])
def test_advertised_topic_has_type_rate_and_latch_of_row(rate: int | Timing, text: str) -> None:
    bench = Bench(rate, latch=True)
    bench.output.advertise()
    info = bench.bus.topic("/probe")
    assert (info.type, info.rate, info.latch, info.publishers) == ("std_msgs/Float64", text, True, ("/node",))


def test_sampled_message_is_encoded_only_if_all_listeners_take_bytes() -> None:
    bench, taken = Bench(100), list[bytes]()
    bench.output.sample(bench.build, lambda: b"bytes")
    bench.bus.subscribe("/probe", bench.hear, take_cdr=taken.append)
    bench.steps(10)
    assert (taken, bench.built, bench.heard) == ([b"bytes"] * 2, [], [])
    other = bench.bus.subscribe("/probe", bench.hear)
    bench.steps(5)
    assert (len(taken), bench.heard) == (2, [0.03, 0.03])
    other.cancel()
    bench.steps(5)
    assert len(taken) == 3
