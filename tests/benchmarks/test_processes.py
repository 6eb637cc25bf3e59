"""Processes that benchmarks need."""

import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from benchmarks.listener import count
from benchmarks.processes import ServerProcess, end, free_port, ros1_environment
from cellwright.middleware.wire.frames import Frame, FrameKind
from cellwright.util.errors import UsageError


@pytest.mark.slow
def test_failed_server_is_reported_with_reason() -> None:
    with pytest.raises(UsageError, match=r"(?s)no server started: .*unknown trial 'nowhere'"):
        ServerProcess("serve", "nowhere", "--port", "0")


def test_process_can_be_ended_twice() -> None:
    # it sleeps only so that it lives on
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"], text=True)
    end(process)
    end(process)
    assert process.returncode is not None


def test_ros1_environments_have_separate_masters() -> None:
    with ros1_environment() as one, ros1_environment() as other:
        folder = Path(one["ROS_HOME"])
        assert folder.is_dir()
        assert one["ROS_IP"] == "127.0.0.1"
        assert one["ROS_HOME"] != other["ROS_HOME"]
        assert one["ROS_MASTER_URI"].startswith("http://127.0.0.1:")
    assert not folder.exists()


def test_free_port_can_be_bound() -> None:
    with socket.create_server(("127.0.0.1", free_port())):
        pass


def test_listener_counts_messages_until_connection_closes() -> None:
    with socket.create_server(("127.0.0.1", 0)) as cell:

        def serve() -> None:
            connection, _ = cell.accept()
            with connection:
                for number in range(3):
                    connection.sendall(Frame(FrameKind.MESSAGE, 1, payload=bytes([number])).encode())
                connection.sendall(Frame(FrameKind.TIME, 0).encode())
                connection.shutdown(socket.SHUT_WR)
                while connection.recv(1 << 16):
                    pass

        thread = threading.Thread(target=serve)
        thread.start()
        assert count("127.0.0.1", cell.getsockname()[1], "/a", "cdr") == 3
        thread.join()
