"""Sockets to policy servers: addresses, the key, and the bound of an exchange."""

import socket
from contextlib import closing

import pytest

from cellwright.clients.policies.policy import PolicyError
from cellwright.clients.policies.sockets import KEY_VARIABLE, cut_after, host_and_port, policy_key


@pytest.mark.parametrize(
    ("address", "default", "found"),
    [
        ("tcp://lab:5", None, ("lab", 5)),
        ("tcp://lab", 5555, ("lab", 5555)),
        ("http://[::1]:8000/act", 80, ("::1", 8000)),
        ("http://user@lab/act", 80, ("lab", 80)),
    ],
)
def test_host_and_port_are_of_the_address(address: str, default: int | None, found: tuple[str, int]) -> None:
    assert host_and_port(address, default) == found


def test_address_without_a_port_needs_a_default() -> None:
    with pytest.raises(PolicyError, match="tcp://lab: no address of a server; write tcp://HOST:PORT"):
        host_and_port("tcp://lab", None)


def test_key_is_not_shown_in_its_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(KEY_VARIABLE, raising=False)
    assert policy_key() is None
    monkeypatch.setenv(KEY_VARIABLE, "secret\x07")
    with pytest.raises(PolicyError) as caught:
        policy_key()
    assert "secret" not in str(caught.value)


def test_connection_is_cut_after_the_time() -> None:
    ours, theirs = socket.socketpair()
    with closing(ours), closing(theirs), cut_after(0.05, lambda: ours):
        assert ours.recv(1) == b""  # the peer sends nothing and is open


def test_connection_in_time_is_not_cut() -> None:
    ours, theirs = socket.socketpair()
    with closing(ours), closing(theirs):
        with cut_after(60.0, lambda: ours):
            theirs.sendall(b"x")
            assert ours.recv(1) == b"x"
        theirs.sendall(b"y")
        assert ours.recv(1) == b"y"
