"""Access to a page."""

import http.client
import socket
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial

import pytest
import viser
import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin

from cellwright.util.errors import UsageError
from cellwright.viewer.web.access import MAX_UNFINISHED, AccessGuard
from cellwright.viewer.web.program import ViserServer
from tests.support.waiting import TIMEOUT, wait_until

SECRET = "a1b2c3"


@contextmanager
def open_guard(token: str = "") -> Iterator[AccessGuard]:
    found = AccessGuard("127.0.0.1", 0, token=token)
    try:
        yield found
    finally:
        found.socket.close()


@contextmanager
def page(token: str = "") -> Iterator[AccessGuard]:
    """Access guard with viser behind it."""
    with open_guard(token) as found:
        with found.guards_viser():
            server = ViserServer(found.host, found.port, verbose=False)
        yield found
        server.stop()


def refusal(found: AccessGuard, path: str = "/", **headers: str) -> str:
    return found.refusal(path, Headers({"Host": f"127.0.0.1:{found.port}", **headers}))


@pytest.mark.parametrize("host", ["127.0.0.1:{}", "localhost:{}", "LOCALHOST", "[::1]:9"])
def test_guard_admits_names_of_this_machine(host: str) -> None:
    with open_guard() as found:
        assert found.refusal("/", Headers({"Host": host.format(found.port)})) == ""


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:80", "", "[", "localhost@evil.example"])
def test_guard_refuses_foreign_host_name(host: str) -> None:
    with open_guard() as found:
        assert found.refusal("/", Headers({"Host": host})) != ""


def test_guard_refuses_foreign_origin() -> None:
    with open_guard() as found:
        own = f"http://127.0.0.1:{found.port}"
        assert refusal(found, Origin=own) == ""
        for origin in ("https://evil.example", "null", "http://127.0.0.1:1", f"{own}.evil.example", "", "http://["):
            assert "are not allowed" in refusal(found, Origin=origin)


def test_guard_with_token_refuses_requests_without_it() -> None:
    with open_guard(SECRET) as found:
        assert found.url == f"http://127.0.0.1:{found.port}/?token={SECRET}"
        assert refusal(found, f"/?token={SECRET}") == ""
        assert refusal(found, Cookie=f"other=1; cellwright_page_{found.port}={SECRET}") == ""
        for path in ("/", "/?token=", "/?token=a1b2c4", f"/?Token={SECRET}", f"/{SECRET}"):
            assert "wrong token" in refusal(found, path)
        for cookie in (f"other={SECRET}", "cellwright_page=", "=;;=", "cellwright_page_1=a1b2c"):
            assert "wrong token" in refusal(found, Cookie=cookie)


def test_guard_refuses_two_host_headers() -> None:
    with open_guard() as found:
        headers = Headers([("Host", "localhost"), ("Host", "evil.example")])
        assert found.refusal("/", headers) == "request must have one Host header and at most one Origin header"
        assert found.refusal("/", Headers()) == "request must have one Host header and at most one Origin header"


def test_guard_on_network_without_token_is_refused() -> None:
    with pytest.raises(UsageError, match="open to the network requires a token"):
        AccessGuard("0.0.0.0", 0)


def test_guard_on_port_in_use_takes_next_port() -> None:
    with open_guard() as first:
        second = AccessGuard("127.0.0.1", first.port)
        second.socket.close()
        assert first.port < second.port <= first.port + 20


@pytest.mark.parametrize(("host", "port"), [("127.0.0.1", 70_000), ("no such host.invalid", 0), ("192.0.2.1", 0)])
def test_guard_on_invalid_address_is_refused(host: str, port: int) -> None:
    with pytest.raises(UsageError):
        AccessGuard(host, port, token=SECRET)


def test_viser_gets_admitted_requests_only() -> None:
    protocol = websockets.Subprotocol(f"viser-v{viser.__version__}")
    with page(SECRET) as found:
        for path, status in (("/", 403), (f"/?token={SECRET}", 200)):
            line = http.client.HTTPConnection(found.host, found.port, timeout=TIMEOUT)
            line.request("GET", path)
            answer = line.getresponse()
            body = answer.read()
            assert answer.status == status
            assert (b"<html" in body.lower()) == (status == 200)
            cookie = answer.headers.get("Set-Cookie", "")
            line.close()
        address = f"ws://127.0.0.1:{found.port}"
        with pytest.raises(InvalidStatus, match="403"):
            connect(address, subprotocols=[protocol])
        shown = {"Cookie": cookie.partition(";")[0]}
        with pytest.raises(InvalidStatus, match="403"):
            connect(address, subprotocols=[protocol], additional_headers=shown, origin=Origin("http://evil.example"))
        with connect(address, subprotocols=[protocol], additional_headers=shown) as browser:
            assert browser.recv(timeout=TIMEOUT)


def test_invalid_messages_of_browser_end_no_other_browser() -> None:
    protocol = websockets.Subprotocol(f"viser-v{viser.__version__}")
    with page() as found:
        address = f"ws://127.0.0.1:{found.port}"
        with connect(address, subprotocols=[protocol]) as good:
            nonsense: tuple[bytes | str, ...] = (
                b"",
                b"\x80",
                b"\xff" * 100,
                "text",
                b"\x81\xa4type\xa4Nope",
                b"\x91" * 100_000,
                b"\xc1",
            )
            for dropped, each in enumerate(nonsense, 1):
                with connect(address, subprotocols=[protocol]) as bad:
                    bad.send(each)
                    wait_until(partial(_has_dropped, found, dropped), "message that is dropped")
            with connect(address, subprotocols=[protocol], max_size=None) as large:
                with suppress(ConnectionClosed):
                    large.send(b"\x00" * (5 << 20))
                wait_until(lambda: _is_cut_off(large), "end of a browser that sends too much")
            with connect(address) as of_another_version, pytest.raises(ConnectionClosed):
                of_another_version.recv(timeout=TIMEOUT)
            assert good.recv(timeout=TIMEOUT)


def _has_dropped(found: AccessGuard, count: int) -> bool:
    return found.incoming.dropped == count


def _is_cut_off(connection: Connection) -> bool:
    """Return whether a connection has ended; ignore its data."""
    try:
        connection.recv(timeout=0.01)
    except TimeoutError:
        return False
    except ConnectionClosed:
        return True
    return False


def test_unsupported_viser_is_refused_by_guard() -> None:
    with open_guard() as found, pytest.raises(UsageError, match="is not supported"), found.guards_viser():
        pass
    assert websockets.asyncio.server.serve.__name__ == "serve"


def test_half_requests_do_not_block_others() -> None:
    with page() as found, ExitStack() as opened:
        half = [opened.enter_context(socket.create_connection((found.host, found.port), TIMEOUT)) for _ in range(80)]
        for connection in half:
            connection.sendall(b"GET / HTTP/1.1\r\n")
        for connection in half[: 80 - MAX_UNFINISHED]:  # the oldest ones make room
            with suppress(ConnectionResetError):
                assert connection.recv(1) == b""
        late = http.client.HTTPConnection(found.host, found.port, timeout=TIMEOUT)
        late.request("GET", "/")
        assert late.getresponse().status == 200
        late.close()
