"""Access guard of the page: listening socket, token and origin checks, filter for messages of browsers.

viser trusts a browser. A message may set any attribute of an element for all browsers, `removed` too. It may fill the
memory with files that no element uses. viser also replays messages on missing forms to all later browsers. So the page
accepts a message only if it has one of the types below, fields of their types, finite numbers and short texts. Its
element must exist, be enabled, and be able to hold the value. The page drops and counts other messages; their browser
stays.

Messages that act pass at a limited rate, one message of each browser in turn. A browser that floods the page waits, and
delays no other for long.

viser accepts any connection. So the guard binds the listening socket, and checks every request, websocket handshakes
too, and every message before viser. On loopback that keeps out other sites in a browser of this machine. They cannot
name this host (DNS rebinding), and their origin gives them away. A page with a token refuses requests without it.
"""

import asyncio
import hmac
import http
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from http.cookies import CookieError, SimpleCookie
from importlib.metadata import version
from ipaddress import ip_address
from typing import Annotated, Any, TypeAlias
from urllib.parse import parse_qs, urlsplit

import msgspec
import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response
from websockets.typing import Data

from cellwright.middleware.server.server import open_listener
from cellwright.util.errors import UsageError
from cellwright.viewer.web.input import Input, read_input
from cellwright.viewer.web.visibility import ReportingPage, read_visibility

MAX_NUMBER = 1e9  # no joint, position or time is larger
MAX_TEXT = 1000  # characters
MAX_RATE = 200.0  # messages per second that act, of all browsers together

_UNSUPPORTED = f"viser {version('viser')} is not supported; reinstall cellwright to get a version that is"

_Number: TypeAlias = Annotated[float, msgspec.Meta(ge=-MAX_NUMBER, le=MAX_NUMBER)]
_Text: TypeAlias = Annotated[str, msgspec.Meta(max_length=MAX_TEXT)]
_Three: TypeAlias = tuple[_Number, _Number, _Number]
_Four: TypeAlias = tuple[_Number, _Number, _Number, _Number]

MAX_CONNECTIONS = 32  # browsers at once
_TOO_MANY = f"too many browsers (at most {MAX_CONNECTIONS})\n"
MAX_UNFINISHED = 32  # connections without a whole request; the oldest makes room for another
MAX_MESSAGE_BYTES = 4 << 20  # bytes of a browser's message
TOKEN = "token"  # noqa: S105 (its name in the page's address)
_COOKIE = "cellwright_page"
_TRIES = 20  # ports to try, from the requested one
_OWN_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})


class _ViserMessage(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    """Message of viser, under its name there."""


class _BrowserCamera(_ViserMessage, tag="ViewerCameraMessage"):
    """Camera of a browser."""

    wxyz: _Four
    position: _Three
    fov: _Number
    near: _Number
    far: _Number
    image_height: _Number
    image_width: _Number
    look_at: _Three
    up_direction: _Three


class _Value(msgspec.Struct, forbid_unknown_fields=True):
    """Only attribute of an element that a browser may set."""

    value: bool | _Number | _Text


class _Update(_ViserMessage, tag="GuiUpdateMessage"):
    """Change of an element."""

    uuid: _Text
    updates: _Value


class _ButtonHold(_ViserMessage, tag="GuiButtonHoldMessage"):
    """Hold of a button."""

    uuid: _Text
    frequency: _Number


class _Start(_ViserMessage, tag="TransformControlsDragStartMessage"):
    """Grab of a handle in the scene."""

    name: _Text
    owner: _Text = ""


class _Drag(_ViserMessage, tag="TransformControlsUpdateMessage"):
    """Drag of a handle."""

    name: _Text
    wxyz: _Four
    position: _Three
    owner: _Text = ""


class _HandleRelease(_ViserMessage, tag="TransformControlsDragEndMessage"):
    """Release of a handle."""

    name: _Text
    owner: _Text = ""


_Taken: TypeAlias = _BrowserCamera | _Update | _ButtonHold | _Start | _Drag | _HandleRelease


class Incoming:
    """Filter of incoming messages."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.dropped = 0
        """Count of dropped messages."""
        self._clock = clock
        self._next = 0.0
        self._elements: Mapping[str, Any] = {}
        self._decoder = msgspec.msgpack.Decoder(_Taken)

    def follow(self, gui: Any) -> None:
        """Accept messages for the elements of viser's GUI.

        Raises:
            UsageError: this version of viser keeps them elsewhere.
        """
        elements = getattr(gui, "_gui_input_handle_from_uuid", None)
        if not isinstance(elements, dict):
            raise UsageError(_UNSUPPORTED)
        self._elements = elements

    def delay(self, data: bytes | str) -> float | None:
        """Delay of a message before viser gets it [s]; None to drop it."""
        try:
            message = self._decoder.decode(data) if isinstance(data, bytes) else None
        except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
            message = None
        if message is None or not self._fits(message):
            self.dropped += 1
            return None
        if isinstance(message, _BrowserCamera):
            return 0.0  # it moves only its browser's view
        now = self._clock()
        self._next = max(self._next + 1 / MAX_RATE, now)
        return self._next - now

    def _fits(self, message: _Taken) -> bool:
        if isinstance(message, _Update | _ButtonHold):
            element = self._elements.get(message.uuid)
            if element is None or not element.visible or getattr(element, "disabled", False):
                return False
            return isinstance(message, _ButtonHold) or _holds(element, message.updates.value)
        if isinstance(message, _Drag | _BrowserCamera):
            return any(message.wxyz)  # a rotation has a direction
        return True


def _holds(element: Any, value: object) -> bool:
    """Return whether an element can hold a value: of its current type, and one of its options if it has any."""
    options = getattr(element, "options", None)
    if options is not None:
        return value in options
    kind = type(element.value)
    return isinstance(value, bool) if kind is bool else kind in (int, float) and type(value) is float


class AccessGuard:
    """Access guard: listening socket and request checks.

    Args:
        host: the address of the socket.
        port: the port; the next ones if it is in use. 0 takes any free port.
        token: required in the page's address; empty admits every client that can reach it.

    Raises:
        UsageError: the address is not available, or open to the network without a token.
    """

    def __init__(self, host: str, port: int, *, token: str = "") -> None:
        self.socket = open_listener(host, port, tries=_TRIES, backlog=MAX_CONNECTIONS)
        self.host, self.port = str(self.socket.getsockname()[0]), int(self.socket.getsockname()[1])
        self.token = token
        if not (token or ip_address(self.host).is_loopback):
            self.socket.close()
            raise UsageError(f"{host}: a page that is open to the network requires a token")
        self.incoming = Incoming()
        """Filter for the messages of admitted browsers."""
        self.on_visibility: Callable[[bool], None] = lambda _is_visible: None
        """Called with True if a tab is shown, and with False if all are hidden or closed."""
        self.on_input: Callable[[Input], None] = lambda _given: None
        """Called with the keys and the gamepad of a browser."""
        self._connected: set[_PendingConnection] = set()
        self._unfinished: dict[Any, None] = {}
        self._html = ReportingPage()

    @property
    def url(self) -> str:
        """The page's address with its token. A wildcard address becomes the name of this machine."""
        host = {"0.0.0.0": socket.gethostname(), "::": socket.gethostname()}.get(self.host, self.host)  # noqa: S104
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{self.port}/" + (f"?{TOKEN}={self.token}" if self.token else "")

    def refusal(self, path: str, headers: Headers) -> str:
        """Return why a request is refused; empty if it is not."""
        if len(headers.get_all("Host")) != 1 or len(headers.get_all("Origin")) > 1:
            return "request must have one Host header and at most one Origin header"
        host = headers["Host"]
        if not self.token and _parts(f"//{host}")[1] not in _OWN_NAMES | {self.host}:
            return f"unknown host {host:.80}; use the address that Cellwright printed"
        origin = headers.get("Origin")
        if origin is not None and _parts(origin)[0] != host.lower():
            return f"requests from {origin:.80} are not allowed"
        if self.token and not self._has_token(path, headers):
            return "missing or wrong token; use the whole address that Cellwright printed"
        return ""

    @contextmanager
    def guards_viser(self) -> Iterator[None]:
        """Make a viser server that starts meanwhile listen at this socket.

        Raises:
            UsageError: this version of viser starts in another way.
        """
        serve, is_used = websockets.asyncio.server.serve, False

        def guarded(handler: Callable[..., Any], *_address: Any, **options: Any) -> Any:
            nonlocal is_used
            is_used = True
            options.update(
                sock=self.socket,
                max_size=MAX_MESSAGE_BYTES,
                create_connection=self._connection,
                process_request=self._looking_at(options.get("process_request")),
            )
            return serve(self._counted(handler), **options)

        websockets.asyncio.server.serve = guarded  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            websockets.asyncio.server.serve = serve  # type: ignore[misc]
        if not is_used:
            raise UsageError(_UNSUPPORTED)

    def _connection(self, *arguments: Any, **options: Any) -> websockets.asyncio.server.ServerConnection:
        """Connection without a request so far."""
        connection = _PendingConnection(*arguments, **options)
        connection.unfinished, connection.incoming = self._unfinished, self.incoming
        connection.on_visibility = self._look_for_tabs
        connection.on_input = lambda given: self.on_input(given)
        return connection

    def _looking_at(self, answer: Callable[..., Any] | None) -> Callable[..., Any]:
        def look(connection: Any, request: Request) -> Response | None:
            self._unfinished.pop(connection, None)
            reason = self.refusal(request.path, request.headers)
            if reason:
                return connection.respond(http.HTTPStatus.FORBIDDEN, reason + "\n")  # type: ignore[no-any-return]
            is_page = request.headers.get("Upgrade", "").lower() != "websocket"
            if not is_page and len(self._connected) >= MAX_CONNECTIONS:
                return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, _TOO_MANY)  # type: ignore[no-any-return]
            response: Response | None = None if answer is None else answer(connection, request)
            if is_page and response is not None:
                self._html.add_script(response)
                response.headers["Referrer-Policy"] = "no-referrer"
                response.headers["X-Frame-Options"] = "SAMEORIGIN"
                response.headers["Cache-Control"] = "no-store"
                if self.token:  # the websocket's address has none, but the browser returns this cookie
                    cookie = f"{_COOKIE}_{self.port}={self.token}; Path=/; HttpOnly; SameSite=Strict"
                    response.headers["Set-Cookie"] = cookie
            return response

        return look

    def _counted(self, handler: Callable[..., Any]) -> Callable[..., Any]:
        async def counted(connection: Any) -> None:
            # Only the thread of the event loop counts, so this needs no lock.
            self._connected.add(connection)
            self._look_for_tabs()
            try:
                await handler(connection)
            except Exception:  # of a message that makes no sense; only its browser suffers
                await connection.close(1008, "invalid message")
            finally:
                self._connected.discard(connection)
                self._look_for_tabs()

        return counted

    def _look_for_tabs(self) -> None:
        self.on_visibility(any(each.shown.is_set() for each in self._connected))

    def _has_token(self, path: str, headers: Headers) -> bool:
        shown = parse_qs(path.partition("?")[2]).get(TOKEN, [])
        for text in headers.get_all("Cookie"):
            try:
                cookies = SimpleCookie(text)
            except CookieError:
                continue
            shown += [morsel.value for name, morsel in cookies.items() if name.startswith(_COOKIE)]
        return any(hmac.compare_digest(each.encode(), self.token.encode()) for each in shown)


class _PendingConnection(websockets.asyncio.server.ServerConnection):
    """Connection that stays in `unfinished` until its request is whole, so that half requests block no others.

    viser receives only messages that `incoming` accepts. What it sends waits while the browser's tab is hidden: viser
    keeps the newest values only.
    """

    unfinished: dict[Any, None]
    incoming: Incoming
    on_visibility: Callable[[], None]
    on_input: Callable[[Input], None]
    shown: asyncio.Event

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.shown = asyncio.Event()
        self.shown.set()
        self.unfinished[self] = None
        if len(self.unfinished) > MAX_UNFINISHED:
            oldest = next(iter(self.unfinished))
            del self.unfinished[oldest]
            oldest.transport.abort()

    async def recv(self, decode: bool | None = None) -> Any:  # noqa: FBT001 -- as it is there
        while True:
            data: Data = await super().recv(decode)
            is_shown = read_visibility(data)
            if is_shown is not None:
                if is_shown:
                    self.shown.set()
                else:
                    self.shown.clear()
                self.on_visibility()
                continue
            if (given := read_input(data)) is not None:
                self.on_input(given)
                continue
            delay = self.incoming.delay(data)
            if delay is not None:
                if delay > 0.0:
                    await asyncio.sleep(delay)
                return data

    async def send(self, *message: Any, **options: Any) -> None:
        await self.shown.wait()
        await super().send(*message, **options)

    def connection_lost(self, exc: Exception | None) -> None:
        self.unfinished.pop(self, None)
        super().connection_lost(exc)


def _parts(address: str) -> tuple[str, str]:
    """Host with port, and host alone, of an Origin header or of `//` and a Host header; empty if it names none."""
    try:
        parts = urlsplit(address)
        return parts.netloc.lower(), parts.hostname or ""
    except ValueError:
        return "", ""
