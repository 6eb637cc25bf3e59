"""Listening addresses from the kernel."""

import os
import socket
import subprocess
import sys

import pytest

from tests.ros1.listening import addresses

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the kernel's tables are Linux's")


@pytest.mark.parametrize("host", ["127.0.0.4", "127.0.0.2", "0.0.0.0"])  # where no other test listens
def test_addresses_of_this_process_include_listening_socket(host: str) -> None:
    before = addresses(os.getpid())
    assert host not in before
    with socket.create_server((host, 0)) as listener:
        assert addresses(os.getpid()) == before | {host}
        with socket.create_connection(listener.getsockname()):  # a connection listens nowhere
            assert addresses(os.getpid()) == before | {host}
    assert addresses(os.getpid()) == before


@pytest.mark.skipif(not socket.has_dualstack_ipv6(), reason="no IPv6 here")
def test_addresses_include_ipv6() -> None:
    with socket.create_server(("::1", 0), family=socket.AF_INET6):
        assert "::1" in addresses(os.getpid())


def test_addresses_of_other_process_end_with_it() -> None:
    listens = "import socket; s = socket.create_server(('127.0.0.3', 0)); print(flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", listens], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        other.stdout.readline()
        assert addresses(other.pid) == {"127.0.0.3"}
        assert addresses(other.pid, os.getpid()) >= {"127.0.0.3"}
        other.communicate("\n")
    assert addresses(other.pid) == set()
