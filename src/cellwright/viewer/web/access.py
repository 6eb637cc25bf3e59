"""Access guard of the page: listening socket, token and origin checks, filter for messages of browsers.

viser trusts a browser. A message may set any attribute of an element for everybody, `removed` too. It may fill the
memory with files that no element asks for, and viser keeps messages on forms that are not there for all who come later.
So a message is taken here only if it has one of the types below, fields of their types, finite numbers and short texts.
Its element must be there, in use, and able to hold the value. Other messages are dropped and counted; their browser
stays.

Messages that act come in at a limited rate, one message of each browser in turn. A browser that floods the page waits,
and delays no other for long.

viser takes in whoever comes. So its listening socket is bound here, and every request, a websocket's first one too, is
looked at before viser sees it, and so is every message. On loopback that keeps out pages of others that a browser of
this machine has open: they cannot name this host (DNS rebinding), and their origin gives them away. With a token nobody
comes in without it.
"""

import asyncio
import hmac
import http
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from http.cookies import CookieError, SimpleCookie
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

MAX_NUMBER = 1e9  # larger numbers are no joint, no place and no time
MAX_TEXT = 1000  # characters
MAX_RATE = 200.0  # messages a second that act, of all browsers together

_Number: TypeAlias = Annotated[float, msgspec.Meta(ge=-MAX_NUMBER, le=MAX_NUMBER)]
_Text: TypeAlias = Annotated[str, msgspec.Meta(max_length=MAX_TEXT)]
_Three: TypeAlias = tuple[_Number, _Number, _Number]
_Four: TypeAlias = tuple[_Number, _Number, _Number, _Number]


class _Message(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    """A message of viser's, under its name there."""


class _Camera(_Message, tag="ViewerCameraMessage"):
    """Where a browser looks from."""

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
    """The only attribute of an element that a browser may set."""

    value: bool | _Number | _Text


class _Update(_Message, tag="GuiUpdateMessage"):
    """An element was used."""

    uuid: _Text
    updates: _Value


class _Hold(_Message, tag="GuiButtonHoldMessage"):
    """A button is held."""

    uuid: _Text
    frequency: _Number


class _Start(_Message, tag="TransformControlsDragStartMessage"):
    """A handle in the scene was taken hold of."""

    name: _Text
    owner: _Text = ""


class _Drag(_Message, tag="TransformControlsUpdateMessage"):
    """It was moved."""

    name: _Text
    wxyz: _Four
    position: _Three
    owner: _Text = ""


class _End(_Message, tag="TransformControlsDragEndMessage"):
    """It was let go."""

    name: _Text
    owner: _Text = ""


_Taken: TypeAlias = _Camera | _Update | _Hold | _Start | _Drag | _End


class Incoming:
    """Decides on messages."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.dropped = 0
        """Count of the messages that were not taken."""
        self._clock = clock
        self._next = 0.0
        self._elements: Mapping[str, Any] = {}
        self._decoder = msgspec.msgpack.Decoder(_Taken)

    def follow(self, gui: Any) -> None:
        """Take messages for the elements of viser's GUI; UsageError: this version of viser keeps them elsewhere."""
        elements = getattr(gui, "_gui_input_handle_from_uuid", None)
        if not isinstance(elements, dict):
            raise UsageError("the page cannot be guarded with this version of viser")
        self._elements = elements

    def delay(self, data: bytes | str) -> float | None:
        """How long a message waits before viser gets it [s]; None to drop it."""
        try:
            message = self._decoder.decode(data) if isinstance(data, bytes) else None
        except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
            message = None
        if message is None or not self._fits(message):
            self.dropped += 1
            return None
        if isinstance(message, _Camera):
            return 0.0  # it moves nobody but its browser
        now = self._clock()
        self._next = max(self._next + 1 / MAX_RATE, now)
        return self._next - now

    def _fits(self, message: _Taken) -> bool:
        if isinstance(message, _Update | _Hold):
            element = self._elements.get(message.uuid)
            if element is None or not element.visible or getattr(element, "disabled", False):
                return False
            return isinstance(message, _Hold) or _holds(element, message.updates.value)
        if isinstance(message, _Drag | _Camera):
            return any(message.wxyz)  # a rotation has a direction
        return True


def _holds(element: Any, value: object) -> bool:
    """Whether an element can have a value: of the type that it has now, and one of its options if it has such."""
    options = getattr(element, "options", None)
    if options is not None:
        return value in options
    kind = type(element.value)
    return isinstance(value, bool) if kind is bool else kind in (int, float) and type(value) is float


MOST_CONNECTIONS = 32  # browsers that may look on at once
MAX_UNFINISHED = 32  # connections whose request is not whole yet; the oldest one makes room for another
LONGEST_MESSAGE = 4 << 20  # bytes of what is taken of a browser
TOKEN = "token"  # noqa: S105 (its name in the page's address)

_COOKIE = "cellwright_page"
_TRIES = 20  # ports that are tried, from the one that was wished for
_OWN_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})


class Door:
    """Listens for browsers.

    Args:
        host: the address to listen at.
        port: the port to listen at; where it is in use, one of the next ones is taken, and 0 takes any that is free.
        token: what has to be in the page's address; empty lets in everybody who can reach it.

    Raises:
        UsageError: the address cannot be listened at, or is open to the network without a token.
    """

    def __init__(self, host: str, port: int, *, token: str = "") -> None:
        self.socket = open_listener(host, port, tries=_TRIES, backlog=MOST_CONNECTIONS)
        self.host, self.port = str(self.socket.getsockname()[0]), int(self.socket.getsockname()[1])
        self.token = token
        if not (token or ip_address(self.host).is_loopback):
            self.socket.close()
            raise UsageError(f"{host} is open to the network: a page there needs a token")
        self.incoming = Incoming()
        """What is taken of the browsers that are let in."""
        self._count = 0
        self._unfinished: dict[Any, None] = {}

    @property
    def url(self) -> str:
        """The page's address, with the token in it. Where it listens at all addresses, it is that of this machine."""
        host = {"0.0.0.0": socket.gethostname(), "::": socket.gethostname()}.get(self.host, self.host)  # noqa: S104
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{self.port}/" + (f"?{TOKEN}={self.token}" if self.token else "")

    def refusal(self, path: str, headers: Headers) -> str:
        """Why a request is not let in; empty when it is."""
        if len(headers.get_all("Host")) != 1 or len(headers.get_all("Origin")) > 1:
            return "a request names one host"
        host = headers["Host"]
        if not self.token and _parts(f"//{host}")[1] not in _OWN_NAMES | {self.host}:
            return f"this page is not at {host:.80}"
        origin = headers.get("Origin")
        if origin is not None and _parts(origin)[0] != host.lower():
            return f"a page of {origin:.80} has no business here"
        if self.token and not self._has_token(path, headers):
            return "this page needs the token that is in its address, as it was printed where the cell was started"
        return ""

    @contextmanager
    def guards_viser(self) -> Iterator[None]:
        """While a viser server is made: have it listen here; UsageError: this version of viser goes another way."""
        serve, is_used = websockets.asyncio.server.serve, False

        def guarded(handler: Callable[..., Any], *_address: Any, **options: Any) -> Any:
            nonlocal is_used
            is_used = True
            options.update(
                sock=self.socket,
                max_size=LONGEST_MESSAGE,
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
            raise UsageError("the page cannot be guarded with this version of viser")

    def _connection(self, *arguments: Any, **options: Any) -> websockets.asyncio.server.ServerConnection:
        """A connection that has sent no request yet."""
        connection = _Connection(*arguments, **options)
        connection.unfinished, connection.incoming = self._unfinished, self.incoming
        return connection

    def _looking_at(self, answer: Callable[..., Any] | None) -> Callable[..., Any]:
        def look(connection: Any, request: Request) -> Response | None:
            self._unfinished.pop(connection, None)
            reason = self.refusal(request.path, request.headers)
            if reason:
                return connection.respond(http.HTTPStatus.FORBIDDEN, reason + "\n")  # type: ignore[no-any-return]
            is_page = request.headers.get("Upgrade", "").lower() != "websocket"
            if not is_page and self._count >= MOST_CONNECTIONS:
                return connection.respond(http.HTTPStatus.SERVICE_UNAVAILABLE, "too many look on already\n")  # type: ignore[no-any-return]
            response: Response | None = None if answer is None else answer(connection, request)
            if is_page and response is not None:
                response.headers["Referrer-Policy"] = "no-referrer"
                response.headers["X-Frame-Options"] = "SAMEORIGIN"
                response.headers["Cache-Control"] = "no-store"
                if self.token:  # the websocket's address has none, but the browser shows it this again
                    cookie = f"{_COOKIE}_{self.port}={self.token}; Path=/; HttpOnly; SameSite=Strict"
                    response.headers["Set-Cookie"] = cookie
            return response

        return look

    def _counted(self, handler: Callable[..., Any]) -> Callable[..., Any]:
        async def counted(connection: Any) -> None:
            self._count += 1  # in the one thread of the event loop
            try:
                await handler(connection)
            except Exception:  # what a browser sent made no sense, and that is its own affair
                await connection.close(1008, "that was no message of this page")
            finally:
                self._count -= 1

        return counted

    def _has_token(self, path: str, headers: Headers) -> bool:
        shown = parse_qs(path.partition("?")[2]).get(TOKEN, [])
        for text in headers.get_all("Cookie"):
            try:
                cookies = SimpleCookie(text)
            except CookieError:
                continue
            shown += [morsel.value for name, morsel in cookies.items() if name.startswith(_COOKIE)]
        return any(hmac.compare_digest(each.encode(), self.token.encode()) for each in shown)


class _Connection(websockets.asyncio.server.ServerConnection):
    """A connection that is in `unfinished` until its request is whole, so that half requests keep nobody out.

    viser receives only what `incoming` takes.
    """

    unfinished: dict[Any, None]
    incoming: Incoming

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.unfinished[self] = None
        if len(self.unfinished) > MAX_UNFINISHED:
            oldest = next(iter(self.unfinished))
            del self.unfinished[oldest]
            oldest.transport.abort()

    async def recv(self, decode: bool | None = None) -> Any:  # noqa: FBT001 -- as it is there
        while True:
            data: Data = await super().recv(decode)
            delay = self.incoming.delay(data)
            if delay is not None:
                if delay > 0.0:
                    await asyncio.sleep(delay)
                return data

    def connection_lost(self, exc: Exception | None) -> None:
        self.unfinished.pop(self, None)
        super().connection_lost(exc)


def _parts(address: str) -> tuple[str, str]:
    """Host with port, and host alone, of an Origin header or `//` and a Host header; empty where it names none."""
    try:
        parts = urlsplit(address)
        return parts.netloc.lower(), parts.hostname or ""
    except ValueError:
        return "", ""
