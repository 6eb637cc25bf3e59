"""Tests of `cellwright operate call` at a served node."""

import pytest

from cellwright.clients.client.session import NodeClient
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.middleware.messages.conversions import joint_state
from tests.cli.conftest import CommandLine


def test_each_command_is_executed_and_refusal_is_printed(cellwright: CommandLine, address: str) -> None:
    def call(word: str) -> tuple[int, str, str]:
        ran = cellwright("operate", "call", word, "--connect", address)
        return ran.status, ran.out, ran.err

    host, port = address.split(":")
    watcher = NodeClient(SocketTransport((host, int(port)), node="/watcher"))
    states, status = watcher.latest("/io_teleop/joint_states"), watcher.latest("/io_teleop/status")
    watcher.publish("/io_teleop/joint_cmd", joint_state(["right_1"], [0.3], time=0))
    watcher.sleep(0.5)
    assert states.message.position[0] == pytest.approx(0.3, abs=0.01)
    code, out, err = call("home")
    assert (code, err) == (0, "")
    assert out.startswith("home: ")
    watcher.sleep(0.2)
    assert states.message.position[0] == pytest.approx(0.0, abs=0.01)
    assert call("disable")[0] == 0
    watcher.sleep(0.2)
    assert not status.message.enabled
    code, out, err = call("home")
    assert (code, out) == (1, "")
    assert err.startswith("home: ")
    assert call("enable")[0] == 0
    assert call("stop") == (0, "stop: stopped\n", "")
    assert call("enable")[0] == 1  # the stop must be cleared first
    assert call("clear-stop")[0] == 0
    watcher.sleep(0.2)
    assert not status.message.emergency_stop
    watcher.close()


@pytest.mark.parametrize("arguments", [["jump"], ["home", "--connect", "127.0.0.1:1"]])
def test_invalid_input_prints_one_line(arguments: list[str], cellwright: CommandLine) -> None:
    ran = cellwright("operate", "call", *arguments)
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith("error: ")
    assert ran.err.count("\n") == 1
