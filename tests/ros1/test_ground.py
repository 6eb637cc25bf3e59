"""Ground of the other tests: real master, real clients, and every failure is reported."""

import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.ros1.ground import Ground, check_end
from tests.ros1.listening import addresses
from tests.support.ports import free_port
from tests.support.processes import Process, name_of
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

TALKS = "import time, sys\nprint('here', flush=True)\nwhile True: time.sleep(0.1)"  # it shall just live on
ENDS_WELL = f"import signal, sys; signal.signal(signal.SIGINT, lambda *_: sys.exit())\n{TALKS}"


def say(topic: str, words: list[str]) -> int:
    import rospy
    from std_msgs.msg import String

    rospy.init_node("speaker")
    publisher = rospy.Publisher(topic, String, queue_size=10)
    wait_until(publisher.get_num_connections, "connection")
    for word in words:
        publisher.publish(word)
    wait_until(lambda: publisher.get_num_connections() == 0, "end of the connection")
    return len(words)


def hear(topic: str, count: int) -> list[str]:
    import rospy
    from std_msgs.msg import String

    rospy.init_node("listener")
    heard: list[str] = []
    subscriber = rospy.Subscriber(topic, String, lambda message: heard.append(message.data))
    wait_until(lambda: len(heard) >= count, "words", seen=lambda: heard)
    subscriber.unregister()
    return heard


def checksums() -> list[str]:
    from cellwright_msgs.srv import Step
    from control_msgs.msg import FollowJointTrajectoryAction
    from osrf_gear.msg import Order

    return [Order._md5sum, FollowJointTrajectoryAction._md5sum, Step._type]


def explode() -> None:
    raise ValueError("on purpose")


@pytest.mark.ros1
def test_two_clients_exchange_messages(master: Ground) -> None:
    listener = master.client(hear, "/words", 2)
    speaker = master.client(say, "/words", ["one", "two"])
    assert listener.value() == ["one", "two"]
    assert speaker.value() == 2


@pytest.mark.ros1
def test_full_master_has_rosout_and_run_id(full_master: Ground) -> None:
    assert full_master.tool("rosnode", "list").split() == ["/rosout"]
    assert full_master.ask("getParam", "/run_id")


@pytest.mark.ros1
def test_generated_messages_have_checksums_of_original(no_master: Ground) -> None:
    order, action, step = no_master.client(checksums).value()
    assert order == "7fadfe9b7f871f7a5285e3dfb4eb98ef"
    assert action.startswith("bc4f9b74")
    assert step == "cellwright_msgs/Step"


@pytest.mark.ros1
def test_master_and_client_listen_on_loopback_only(master: Ground) -> None:
    listener = master.client(hear, "/words", 1)
    wait_until(lambda: "/listener" in master.tool("rosnode", "list"), "listener")
    assert master.process is not None
    for pid in (master.process.pid, listener.pid):
        assert addresses(pid) == {"127.0.0.1"}


@pytest.mark.ros1
def test_restarted_master_keeps_port(master: Ground) -> None:
    uri = master.uri
    for number in (signal.SIGINT, signal.SIGKILL):
        master.stop_master(number)
        with pytest.raises(ConnectionRefusedError):
            master.ask("getPid")
        master.start_master()
        assert master.uri == uri


@pytest.mark.ros1
def test_failing_client_raises_assertion_error(no_master: Ground) -> None:
    with pytest.raises(AssertionError, match="on purpose"):
        no_master.client(explode).value()


@pytest.mark.ros1
def test_failing_tool_raises_assertion_error(no_master: Ground) -> None:
    with pytest.raises(AssertionError, match="Unable to communicate with master"):
        no_master.tool("rostopic", "list")


@pytest.fixture
def python(tmp_path: Path) -> Iterator[Callable[[str], Process]]:
    """Starts programs under this Python."""
    started: list[Process] = []

    def start(program: str) -> Process:
        started.append(Process([sys.executable, "-c", program], dict(os.environ), tmp_path))
        return started[-1]

    yield start
    for process in started:
        process.kill()


def test_wait_for_missing_line_times_out(python: Callable[[str], Process]) -> None:
    process = python(TALKS)
    process.wait_for("^here$")
    with pytest.raises(AssertionError, match=r"no 'there' within 0\.3 s"):
        process.wait_for("there", 0.3)


def test_wait_for_line_of_ended_process_fails_at_once(python: Callable[[str], Process]) -> None:
    process = python("print('here')")
    process.wait_for("^here$")
    with pytest.raises(AssertionError, match="no 'there'"):
        process.wait_for("there")


@pytest.mark.parametrize(
    ("program", "match"),
    [
        (f"import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n{TALKS}", "still there"),
        (TALKS, "Traceback"),  # of KeyboardInterrupt
        (f"import signal, sys; signal.signal(signal.SIGINT, lambda *_: sys.exit(3))\n{TALKS}", "status 3"),
        (f"import signal; signal.signal(signal.SIGINT, signal.SIG_DFL)\n{TALKS}", "status -2"),
        (
            f"import subprocess; subprocess.Popen(['sleep', '60'], start_new_session=True)\n{ENDS_WELL}",
            "left behind: .*sleep 60",
        ),
    ],
)
def test_check_end_of_bad_end_raises(program: str, match: str, python: Callable[[str], Process]) -> None:
    process = python(program)
    process.wait_for("^here$")
    bounds = {"timeout": 1.0} if match == "still there" else {"children": 0.3}
    with pytest.raises(AssertionError, match=match):
        check_end(process, **bounds)


def test_check_end_of_good_end_passes(python: Callable[[str], Process]) -> None:
    process = python(ENDS_WELL)
    process.wait_for("^here$")
    check_end(process)


def test_relatives_include_grandchildren(python: Callable[[str], Process]) -> None:
    process = python("import subprocess as s; s.Popen(['sh', '-c', 'sleep 61 & sleep 62'], start_new_session=True)")
    assert process.finish() == 0
    wait_until(lambda: len(process.relatives()) == 3, "grandchildren")
    assert {"sleep 61", "sleep 62"} < {name_of(pid) for pid in process.relatives()}
    process.kill()
    wait_until(lambda: not process.relatives(), "end of them")


def test_free_ports_are_free_and_differ() -> None:
    ports = [free_port() for _ in range(5)]
    assert len(set(ports)) == 5
    for port in ports:
        with socket.create_server(("127.0.0.1", port)):
            pass
