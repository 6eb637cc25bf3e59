"""A random agent, and ways to watch it at work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.cell.interface.rows import rows
from cellwright.clients.client.in_process import Transport
from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import EndpointKind
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.osrf_gear import VacuumGripperControlRequest
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.recorder import Recorder
from cellwright.util.pose import Pose
from tests.support.cells import INITIAL, WHOLE, order, way

BEAM = Pose((1.6, 3.9, 0.91))
"""A beam that parts of the belt interrupt soon after their arrival."""

SENSORS = tuple(
    replace(each, pose=replace(each.pose, position=BEAM.position)) if each.type == "break_beam" else each
    for each in WHOLE.sensors
)

TRIAL = replace(WHOLE, sensors=SENSORS, orders=(order(), order(1, start_time=0.4)))

TOPICS = sorted(
    {
        row.name
        for row in rows(TRIAL, competition=True)
        if row.kind is EndpointKind.TOPIC and row.direction is Direction.OUT
    }
)

Action = tuple[str, Any]
Watcher = Callable[[Cell, Path], None]

ACTIONS: st.SearchStrategy[list[Action]] = st.lists(
    st.one_of(
        st.tuples(st.just("subscribe"), st.sampled_from(TOPICS)),
        st.tuples(st.just("unsubscribe"), st.integers(0, 9)),
        st.tuples(st.just("wait"), st.integers(1, 150)),
        st.tuples(st.just("move"), st.integers(0, 6)),
        st.tuples(st.just("grip"), st.booleans()),
    ),
    min_size=4,
    max_size=40,
)
"""Actions of a random agent, one after the other; its waits are in steps of 2 ms."""


def work(transport: Transport, actions: list[Action]) -> list[tuple[int, str, bytes]]:
    """Execute the actions of a random agent; return the time, topic and content of each message it got, in this order.

    Its targets for the arm depend on its messages, so that the state reveals any difference in them.
    """
    heard: list[tuple[int, str, bytes]] = []
    leave: list[Callable[[], None]] = []

    def listen(topic: str) -> Callable[[], None]:
        return transport.subscribe(topic, lambda message: heard.append((transport.now(), topic, TYPES.to_cdr(message))))

    transport.call("/ariac/start_competition", TriggerRequest())
    for kind, value in actions:
        if kind == "subscribe":
            leave.append(listen(value))
        elif kind == "unsubscribe" and leave:
            leave.pop(value % len(leave))()
        elif kind == "wait":
            transport.advance(transport.now() + value * 2_000_000)
        elif kind == "move":
            goal = list(INITIAL)
            goal[value] += 0.001 * (sum(topic.count("/") + len(data) for _, topic, data in heard) % 97)
            transport.publish("/ariac/arm/command", way(tuple(goal)))
        elif kind == "grip":
            transport.call("/ariac/gripper/control", VacuumGripperControlRequest(value))
    transport.advance(transport.now() + 200_000_000)
    return heard


def unwatched(_cell: Cell, _folder: Path) -> None:
    """Leave the agent alone."""


def all_topics(cell: Cell, _folder: Path) -> None:
    """Listen to everything from the start, in another order than the interface's."""
    for info in reversed(cell.bus.topics()):
        cell.bus.subscribe(info.name, lambda _: None, node="/onlooker")


def recording(cell: Cell, folder: Path) -> None:
    """Record the run."""
    Recorder(cell, folder / "run.mcap", RecordingHeader("cell", cell.name, {}))


def coming_and_going(cell: Cell, _folder: Path) -> None:
    """Listen now and then, to a few topics each time."""
    names = [info.name for info in cell.bus.topics()]
    there: list[Any] = []

    def change(index: int) -> None:
        while there:
            there.pop().cancel()
        there.extend(cell.bus.subscribe(name, lambda _: None, node="/onlooker") for name in names[index % 4 :: 4])

    cell.simulation.watch("onlooker", Fraction(7, 100), change)


WATCHERS = (all_topics, recording, coming_and_going)
