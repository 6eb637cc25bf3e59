"""A cell served to real ROS 1: start, recovery from failures, and an end with all its processes."""

from __future__ import annotations

import os
import random
import re
import shlex
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cellwright.cell.interface.rows import SIMULATOR
from cellwright.cli.options import SPEED
from cellwright.middleware.ros1.host import Ros1
from cellwright.util.errors import UsageError
from tests.ros1.ground import Ground, check_end, ground
from tests.ros1.listening import addresses
from tests.support.ports import free_port
from tests.support.processes import Process, name_of
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

GAZEBO, PUBLISHER = "/gazebo", "/robot_state_publisher"


@pytest.fixture(autouse=True)
def slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let time pass slowly in the cells that a test starts: no test depends on it."""
    monkeypatch.setenv(SPEED, "0.4")


def nodes(ground: Ground) -> set[str]:
    """Return the nodes that are registered as publishers."""
    published, _, _ = ground.ask("getSystemState")
    return {node for _, publishers in published for node in publishers}


def parameter(ground: Ground, name: str) -> Any:
    return ground.ask("getParam", name)


def pid_of(cell: Process, word: str) -> int:
    """Return the descendant of a cell's process that has a word in its command line."""
    found = [pid for pid in cell.relatives() if pid != cell.pid and word in command_of(pid)]
    assert len(found) == 1, [command_of(pid) for pid in cell.relatives()]
    return found[0]


def command_of(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


def refused(ground: Ground, *options: str, **more: str) -> str:
    """Return the single error line of a cell that cannot be served."""
    cell = ground.cellwright("serve", "lesson", "--ros1", "--port", "0", *options, **more)
    assert cell.finish() == 2
    lines = [line for line in (cell.out + cell.err).splitlines() if line.strip()]
    assert len(lines) == 1, lines
    return lines[0]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[tuple[Ground, Process]]:
    """A master and a cell, for tests that do not change them."""
    with ground(tmp_path_factory.mktemp("served"), ros1_messages) as made:
        yield made, made.serve("lesson")


def test_serve_is_ready_when_all_is_registered(served: tuple[Ground, Process]) -> None:
    master, cell = served
    ready = re.search(r"^ready: lesson at 127\.0\.0\.1:\d+, real time, ROS 1 at (\S+)$", cell.out, re.MULTILINE)
    assert ready is not None
    assert ready[1] == master.uri.rstrip("/")
    assert nodes(master) >= {GAZEBO, PUBLISHER}
    assert parameter(master, "/use_sim_time") is True
    assert parameter(master, "/gazebo/enable_ros_network") is False
    assert parameter(master, "/ariac/arm/joints")[0] == "linear_arm_actuator_joint"
    assert parameter(master, "/robot_description").startswith("<?xml")


def test_use_sim_time_is_set_before_cell_is_built(master: Ground) -> None:
    cell = master.cold_cellwright("serve", "lesson", "--ros1", "--port", "0")
    wait_until(lambda: master.ask("hasParam", "/use_sim_time"), "use_sim_time")
    assert not master.ask("hasParam", "/robot_description")
    assert "ready" not in cell.out
    cell.wait_for("^ready")


def test_serve_without_master_starts_one_and_ends_it(no_master: Ground) -> None:
    cell = no_master.serve("lesson")
    wait_until(lambda: "/rosout" in nodes(no_master), "rosout")
    assert no_master.ask("hasParam", "/run_id")
    (rosout,) = [pid for pid in cell.relatives() if re.search("/rosout", command_of(pid))]
    os.kill(rosout, signal.SIGKILL)
    cell.wait_for("the node /rosout was ended by SIGKILL; restarting it")
    wait_until(lambda: any(re.search("/rosout", command_of(pid)) for pid in cell.relatives()), "another")
    check_end(cell)
    with pytest.raises(OSError):  # noqa: PT011 - whatever it is, nobody answers
        no_master.ask("getPid")


def test_serve_listens_on_loopback_only(no_master: Ground) -> None:
    """Except for C++ nodes, whose library listens for calls of other nodes at every address."""
    cell = no_master.serve("lesson", ROS_IP="")
    ours = {cell.pid, *(pid for pid in cell.relatives() if not re.search(f"rosout|{PUBLISHER}", command_of(pid)))}
    listening = [hosts for pid in ours if (hosts := addresses(pid))]
    assert len(listening) >= 3  # the cell, the master, the bridge
    assert set.union(*listening) == {"127.0.0.1"}


def test_second_simulator_at_same_master_is_refused(served: tuple[Ground, Process]) -> None:
    master, first = served
    said = refused(master)
    assert re.match(r"error: a simulator already runs at http://\S+: its node /gazebo answers at http://", said)
    assert first.running
    assert GAZEBO in nodes(master)


def test_killed_simulator_does_not_block_next_one(master: Ground) -> None:
    first = master.serve("lesson")
    first.signal(signal.SIGKILL)
    first.finish()
    assert master.serve("lesson").running


def test_serve_without_rospy_prints_instructions(no_master: Ground) -> None:
    said = refused(no_master, CELLWRIGHT_ROS1_PYTHON=sys.executable)
    assert said.startswith(f"error: CELLWRIGHT_ROS1_PYTHON is {sys.executable}, which has no rospy; on Debian 12")


def test_serve_with_absent_remote_master_is_refused(no_master: Ground) -> None:
    said = refused(no_master, ROS_MASTER_URI="http://nowhere.invalid:11311")
    assert said == (
        "error: no ROS master answers at http://nowhere.invalid:11311, which is not on this machine; "
        "check ROS_MASTER_URI"
    )
    assert refused(no_master, ROS_MASTER_URI="nonsense").startswith(
        "error: ROS_MASTER_URI is 'nonsense', not an address"
    )


def test_serve_with_other_program_at_master_address_is_refused(no_master: Ground) -> None:
    other = no_master.start(["python3", "-m", "http.server", "--bind", "127.0.0.1", str(no_master.port)])
    other.wait_for("Serving HTTP")
    assert f"the program at http://127.0.0.1:{no_master.port} is not a ROS master" in refused(no_master)


def test_unknown_trial_is_refused_before_master_is_started(no_master: Ground) -> None:
    cell = no_master.cellwright("serve", "no-such-trial", "--ros1", "--port", "0")
    assert cell.finish() == 2
    assert not cell.relatives()
    assert "no-such-trial" in cell.err


def test_serve_on_port_in_use_is_refused(master: Ground) -> None:
    port = free_port()
    master.cellwright("serve", "lesson", "--port", str(port)).wait_for("^ready")
    cell = master.cellwright("serve", "lesson", "--ros1", "--port", str(port))
    assert cell.finish() == 2
    assert f"127.0.0.1:{port}" in cell.err
    wait_until(lambda: GAZEBO not in nodes(master), "node less")


def test_own_master_that_is_killed_is_restarted(no_master: Ground) -> None:
    cell = no_master.serve("lesson")
    run = parameter(no_master, "/run_id")
    os.kill(pid_of(cell, "rosmaster"), signal.SIGKILL)
    cell.wait_for("the ROS master at .* was ended by SIGKILL; restarting it")
    cell.wait_for("all topics and services are in ROS 1 again")
    assert nodes(no_master) >= {GAZEBO, PUBLISHER}
    assert parameter(no_master, "/run_id") != run


def test_node_ended_by_rosnode_kill_registers_again(master: Ground) -> None:
    cell = master.serve("lesson")
    master.tool("rosnode", "kill", GAZEBO)
    cell.wait_for("all topics and services are in ROS 1 again")
    assert GAZEBO in nodes(master)


def test_bridge_yields_to_other_node_of_same_name(master: Ground) -> None:
    cell = master.serve("lesson")
    program = "import rospy; rospy.init_node('gazebo'); print('there', flush=True); rospy.spin()"
    usurper = master.client(program)
    usurper.wait_for("there")
    cell.wait_for("another node has the name /gazebo now")
    assert cell.running
    assert "in ROS 1 again" not in cell.out
    usurper.signal(signal.SIGKILL)
    usurper.finish()
    cell.wait_for("all topics and services are in ROS 1 again")


def test_ctrl_c_ends_all_and_unregisters_at_master(master: Ground) -> None:
    cell = master.serve("lesson")
    check_end(cell)
    assert not {GAZEBO, PUBLISHER} & nodes(master)
    _, _, services = master.ask("getSystemState")
    assert not services


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL], ids=lambda each: each.name)
@pytest.mark.parametrize("stage", ["imports", "master", "ready"])
def test_signal_at_any_stage_of_start_ends_serve(no_master: Ground, number: signal.Signals, stage: str) -> None:
    """The stages of the start are each interrupted somewhere; `Ground.close` checks for leftover processes."""
    start = no_master.cold_cellwright if stage == "imports" else no_master.cellwright
    cell = start("serve", "lesson", "--ros1", "--port", "0")
    if stage == "imports":
        time.sleep(random.Random(number).uniform(0.0, 0.8))  # noqa: TID251 - no condition: any moment is to be met
    elif stage == "master":
        wait_until(lambda: has_parameter(no_master, "/run_id"), "master", seen=lambda: cell.said)
    else:
        cell.wait_for("^ready")
    cell.signal(number)
    status = cell.finish()
    assert status in (0, -number) or (status, cell.err) == (130, "interrupted\n")
    assert "Traceback" not in cell.out + cell.err
    assert "error" not in cell.out + cell.err
    wait_until(lambda: not cell.relatives(), "end of all processes", seen=lambda: list(map(name_of, cell.relatives())))
    with pytest.raises(ConnectionRefusedError):
        no_master.ask("getPid")


def has_parameter(ground: Ground, name: str) -> bool:
    """Return whether a master answers and has a parameter."""
    try:
        return bool(ground.ask("hasParam", name))
    except OSError:
        return False


def test_cell_in_background_of_script_ends_on_signal(no_master: Ground) -> None:
    """In a shell without job control, background programs and their children ignore Ctrl-C."""
    script = f"{shlex.quote(sys.executable)} -m cellwright serve lesson --ros1 --port 0 & wait"
    shell = no_master.start(["sh", "-c", script], PYTHONPATH=os.environ.get("PYTHONPATH", ""))
    shell.wait_for("^ready")
    os.kill(pid_of(shell, "-m cellwright serve"), signal.SIGTERM)
    assert shell.finish() == 0
    wait_until(lambda: not shell.relatives(), "end of all processes")


def test_bridge_that_cannot_be_started_is_tried_again(master: Ground, monkeypatch: pytest.MonkeyPatch) -> None:
    """For example if the machine has no process left for the bridge."""
    said: list[str] = []
    with Ros1(said.append, environment=master.environment, identity=SIMULATOR) as ros:
        ros.prepare()

        def fail(*_: Any, **__: Any) -> None:
            raise OSError(11, "Resource temporarily unavailable")

        monkeypatch.setattr("cellwright.middleware.ros1.host.ros1.BridgeProcess", fail)
        with pytest.raises(UsageError, match=r"bridge could not be started: .*temporarily unavailable"):
            ros.join(("127.0.0.1", 9), {"x": 1}, lambda _seconds: None)

        def has_said(count: int) -> bool:
            ros.poll()
            return len(said) >= count

        wait_until(lambda: has_said(3), "three reports")
    assert {line.partition(":")[0] for line in said} == {"a ROS 1 program could not be started"}
    assert parameter(master, "/x") == 1
