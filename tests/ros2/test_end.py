"""Ends of a served cell, twenty in all: by either signal, before it is ready, once it is seen, and amid messages."""

import itertools
import signal
from functools import partial
from pathlib import Path

import pytest

import cellwright
from tests.ros2.ground import Ground, bridge_pid
from tests.support.processes import Process
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

SHARED = Path("/dev/shm")
"""Shared memory, in which Fast DDS has files of each process."""

ROOM = 16 << 20
"""Least shared memory of a bridge, for pictures [bytes]."""


def observe() -> None:
    """Print when the cell's node comes and goes, and when joint states begin to flow from it.

    A node is there while it publishes its log. Its name says less. If a late notice of the node comes after its end, a
    program's own list of names has it from then on (1 end in 240 on a busy machine; `rmw_dds_common` of Jazzy).
    """
    from rclpy_node import Node

    def has_node() -> bool:
        return bool(me.node.count_publishers("/rosout") > 1)  # one is the observer's

    with Node("observer") as me:
        states = me.listen("/ariac/joint_states", "sensor_msgs/JointState")
        me.wait(lambda: me.node.count_publishers("/rosout") == 1, "own log")
        print("observing", flush=True)
        while True:
            me.wait(has_node, "node")
            states.clear()
            print("come", flush=True)
            me.wait(lambda: states or not has_node(), "message")
            if states:
                print("hears", flush=True)
            me.wait(lambda: not has_node(), "end of the node")
            print("gone", flush=True)


def shared_files(pid: int) -> set[str]:
    """Return the files of shared memory that a process uses, but for ports, which others may use as well."""
    lines = Path(f"/proc/{pid}/maps").read_text().splitlines()
    names = {Path(line.split(maxsplit=5)[5]).name for line in lines if f" {SHARED}/" in line}
    return {name for name in names if "_port" not in name}


def _is_alone(cell: Process) -> bool:
    return not cell.relatives()


def end_amid_callbacks(source: str, rounds: int) -> None:
    """End the bridge's node, and that of tests, while their threads call callbacks as fast as they can."""
    import sys

    sys.path.append(source)
    from rclpy_node import Node

    from cellwright.middleware.ros2.bridge.node import RosNode

    for _ in range(rounds):
        served = RosNode("served", ())
        sys.setswitchinterval(1e-6)  # what the threads do alternates as finely as it can
        for _ in range(8):
            served.node.create_timer(1e-5, list)
        served.start()
        served.close()
        with Node() as me:
            for _ in range(8):
                me.node.create_timer(1e-5, list)


def test_node_ends_amid_callbacks_without_a_complaint(domain: Ground) -> None:
    program = domain.client(end_amid_callbacks, str(Path(cellwright.__file__).parents[1]), 20)
    assert program.value() is None
    assert not program.err


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ten_ends_are_clean_and_leave_nothing(domain: Ground, number: signal.Signals) -> None:
    observer = domain.client(observe)
    observer.wait_for("^observing$")
    for moment in itertools.islice(itertools.cycle(("starting", "come", "hears")), 10):
        seen = observer.out.split().count(moment)
        before = {path.name for path in SHARED.iterdir()}
        cell = domain.cellwright("serve", "lesson", "--ros2", "--port", "0", "-d")
        bridge = bridge_pid(cell)
        if moment != "starting":
            observer.wait_for(f"^{moment}$", after=seen)
        own = shared_files(bridge) - before
        if moment != "starting":
            assert max((SHARED / name).stat().st_size for name in own) > ROOM
        cell.signal(number)
        assert cell.finish() == 0, cell.tell(moment)
        assert not cell.err, cell.tell(moment)
        wait_until(partial(_is_alone, cell), "end of all processes")
        wait_until(
            lambda: observer.out.split().count("come") == observer.out.split().count("gone"),
            "end of the node",
            seen=lambda: observer.out,
        )
        assert not {name for name in own if (SHARED / name).exists()}, moment
    observer.kill()
