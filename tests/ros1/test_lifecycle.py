"""Processes that are killed, stopped and restarted: the cell goes on, registers again, and leaves nothing behind."""

import os
import random
import re
import signal
import time
from typing import Any, cast
from xmlrpc.client import ServerProxy

import pytest

from cellwright.cli.options import SPEED
from cellwright.clients.client.socket_transport import SocketTransport
from tests.ros1.ground import Ground, check_end
from tests.support.processes import Process, name_of
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

NODES = {"/gazebo", "/robot_state_publisher"}


@pytest.fixture(autouse=True)
def slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let time pass slowly in the cells that a test starts: no test depends on it."""
    monkeypatch.setenv(SPEED, "0.4")


def bridge_of(process: Process) -> int:
    found = [pid for pid in process.relatives() if re.search(r"ros1/bridge(/bridge\.py)? ", name_of(pid) + " ")]
    (pid,) = [pid for pid in found if "robot_state_publisher" not in name_of(pid).split()[0]]
    return pid


def simulated(process: Ground) -> float:
    """Return simulation time, from ROS 1."""
    said = process.tool("rostopic", "echo", "-n", "1", "/clock")
    found = re.search(r"secs: (\d+)\s+nsecs:\s*(\d+)", said)
    assert found is not None
    return int(found[1]) + int(found[2]) / 1e9


def is_whole(master: Ground) -> bool:
    """Return whether everything is registered: both nodes, and the topics of the lesson's cell."""
    try:
        publishers, subscribers, services = (dict(role) for role in master.ask("getSystemState"))
    except OSError:
        return False
    return (
        {node for role in (publishers, subscribers) for nodes in role.values() for node in nodes} >= NODES
        and "/ariac/joint_states" in publishers
        and "/ariac/arm/command" in subscribers
        and "/ariac/agv1" in services
    )


def test_program_that_starts_while_time_stands_hears_the_clock(master: Ground) -> None:
    process = master.serve("lesson", "-d")
    host, port = process.wait_for(r"^ready: lesson at (\S+):(\d+)").groups()
    operator = SocketTransport((host, int(port)), node="/operator")
    operator.ask_server("cellwright/control", {"action": "pause"})
    state = operator.ask_server("simulation/GetEntityState", {"entity": "arm"})["state"]["header"]["stamp"]
    assert simulated(master) == pytest.approx(state["sec"] + state["nanosec"] / 1e9)
    operator.ask_server("simulation/ResetSimulation")
    wait_until(lambda: simulated(master) == 0.0, "time 0")
    operator.close()


def test_killed_bridge_is_restarted(master: Ground) -> None:
    process = master.serve("lesson", "-d")
    before = simulated(master)
    killed = bridge_of(process)
    os.kill(killed, signal.SIGKILL)
    process.wait_for("the ROS 1 bridge was ended by SIGKILL; restarting it")
    process.wait_for("all topics and services are in ROS 1 again")
    wait_until(
        lambda: master.ask("lookupNode", "/gazebo") and bridge_of_or_none(process) not in (None, killed), "bridge"
    )
    wait_until(lambda: is_answering(master), "answer of the new bridge")
    assert simulated(master) > before, "the cell went on meanwhile"
    assert set(master.tool("rosnode", "list").split()) >= NODES
    assert "init" in master.tool("rostopic", "echo", "-n", "1", "/ariac/competition_state")
    assert "success: True" in master.tool("rosservice", "call", "/ariac/start_competition")
    assert "order_0" in master.tool("rostopic", "echo", "-n", "1", "/ariac/orders")


def bridge_of_or_none(process: Process) -> int | None:
    try:
        return bridge_of(process)
    except ValueError:
        return None


def is_answering(master: Ground) -> bool:
    """Return whether the registered node /gazebo answers."""
    ping = master.start(["rosnode", "ping", "-c", "1", "/gazebo"])
    ping.finish()
    return "xmlrpc reply" in ping.out


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_cell_registers_again_at_restarted_master(master: Ground, number: int) -> None:
    process = master.serve("lesson", "-d")
    assert "success: True" in master.tool("rosservice", "call", "/ariac/start_competition")
    master.stop_master(number)
    lost = process.wait_for(".*master at .* is gone.*")[0]
    assert "parameters" in lost
    assert process.running
    master.start_master()
    process.wait_for("all topics and services are in ROS 1 again")
    wait_until(lambda: is_whole(master), "registration at the new master", seen=master.log)
    wait_until(lambda: is_answering(master), "answer of the bridge")
    assert master.ask("getParam", "/use_sim_time") is True
    assert master.ask("getParam", "/robot_description").startswith("<")
    assert master.ask("getParam", "/ariac/arm/type") == "effort_controllers/JointTrajectoryController"
    assert 'data: "go"' in master.tool("rostopic", "echo", "-n", "1", "/ariac/competition_state")


def test_sigint_at_random_moments_of_start_ends_cell(master: Ground) -> None:
    """From the first import until the competition runs; a failure reports the moments."""
    chance = random.Random(0)
    moments = [0.15, 0.7, *(chance.uniform(0.5, 3.5) for _ in range(4))]
    for moment in moments:
        process = master.cold_cellwright("serve", "lesson", "--ros1", "--port", "0")
        time.sleep(moment)  # noqa: TID251 - no condition: the moment is what is tested
        try:
            end(process)
        except AssertionError as error:
            raise AssertionError(f"after {moment:.2f} s: {error}") from None
        wait_until(lambda: not published(master), "end of the registrations", seen=lambda: published(master))


@pytest.mark.parametrize("count", [1, 8, 16, 24])
def test_sigint_during_registration_leaves_nothing_at_master(master: Ground, count: int) -> None:
    process = master.cellwright("serve", "lesson", "--ros1", "--port", "0")
    wait_until(lambda: len(published(master)) >= count, f"{count} registrations", seen=lambda: published(master))
    end(process)
    wait_until(lambda: not published(master), "end of the registrations", seen=lambda: published(master))


def test_state_publisher_that_hangs_leaves_nothing_at_master(master: Ground) -> None:
    process = master.serve("lesson")
    address = master.ask("lookupNode", "/robot_state_publisher")
    with ServerProxy(address) as node:
        _, _, pid = cast("Any", node).getPid("/test")
    os.kill(pid, signal.SIGSTOP)
    end(process)
    wait_until(lambda: not published(master), "end of the registrations", seen=lambda: published(master))


def end(process: Process) -> None:
    """Send Ctrl-C. Before the command has begun, the program dies of the signal, or only reports it."""
    status = process.interrupt()
    said = process.out + process.err
    if status == -signal.SIGINT or (status, said) == (130, "interrupted\n"):
        return
    assert status == 0, f"status {status}: {said}"
    check_end(process)


def published(master: Ground) -> list[str]:
    """Return the topics that the nodes of a cell have registered at the master."""
    return [name for role in master.ask("getSystemState") for name, nodes in role if NODES & set(nodes)]
