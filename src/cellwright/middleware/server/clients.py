"""Clients of the server: connections with send buffer and heartbeat, and the registry of connected clients."""

import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator

from cellwright.middleware.wire.frames import MAX_CLIENT_FRAME_BYTES, SAID, Decoder, Frame, FrameError, FrameKind
from cellwright.util import errors
from cellwright.util.errors import CellwrightError

PING_PERIOD = 0.02  # wall time [s] between an answer and the next PING
LATE = 0.1  # a client is behind if its answer takes longer than this [s]

MAX_HELD = 10.0
"""Longest time [s] for which simulation time stands for clients; a client that takes longer must answer first."""

REGAIN_RATE = 4.0
"""Seconds of `MAX_HELD` that clients regain for each second in which time does not stand for them."""

_MAX_LOOK_INTERVAL = 0.5  # [s]; a longer interval is a pause, in which time stood for another reason
BEHIND = 1 << 20
"""Waiting bytes of a client from which on the server reads nothing more from it, and in lockstep no time passes."""
FULL = 4 << 20
"""Bytes offered to a client and not taken from which on its messages are dropped; less if there are many clients."""
AT_ONCE = 32 << 20
"""The same for bytes that were not offered to it yet: one tick may have pictures of several cameras."""
MAX_WAITING = 256 << 20  # bytes that may wait for all clients together
MAX_HELLO_BYTES = 1 << 16  # bytes of the longest frame that is accepted before HELLO
_PIECE = 1 << 16
MAX_CLIENTS = 200
"""Largest number of connections; those without a HELLO are rejected first. `select` can watch some 1000."""
SLOW_CLIENT_TIMEOUT = 30.0
"""Time [s] after which the server disconnects a client that takes nothing of what waits for it, or sends no HELLO."""
MAX_INCOMPLETE = 64 << 20
"""Largest number of bytes of incomplete frames of all clients; beyond it the client with most is disconnected."""
_BRIDGES = {f"ros{number}": f"the bridge to ROS {number}, or a subscriber there," for number in (1, 2)}
"""Clients that users do not know by name, by the encoding that only they have."""
_MAX_NAMED = 10  # disconnected clients, in one report
_CHECK_PERIOD = 1.0  # wall time [s] between two checks for clients that are behind, stuck or silent


class Heartbeat:
    """PING and PONG of one client, on the wall clock.

    Example:
        >>> heartbeat = Heartbeat(now=0.0)
        >>> heartbeat.ping(0.02)
        1
        >>> heartbeat.is_late(0.1), heartbeat.is_late(0.2), heartbeat.is_late(20.0)
        (False, True, False)
        >>> heartbeat.pong(1, 0.3)
        >>> heartbeat.is_late(0.31)
        False
    """

    def __init__(self, now: float) -> None:
        self._number = 0
        self._sent: float | None = None  # time of the PING that is not answered yet
        self._next = now

    def ping(self, now: float) -> int:
        """Return the number of the PING that is due; 0 if none is."""
        if self._sent is not None or now < self._next:
            return 0
        self._number = self._number % 0xFFFFFFFF + 1
        self._sent = now
        return self._number

    def pong(self, number: int, now: float) -> None:
        """Take an answer; answers to other PINGs than the last are ignored."""
        if number == self._number and self._sent is not None:
            self._sent, self._next = None, now + PING_PERIOD

    def is_late(self, now: float) -> bool:
        """True if the answer is late, but within `MAX_HELD`."""
        return self._sent is not None and LATE < now - self._sent < LATE + MAX_HELD


class HoldBudget:
    """Budget of time holds for all clients together: `MAX_HELD` at a stretch, four fifths in the long run.

    All clients share one budget: a client that reconnects gets no new one.
    """

    def __init__(self, now: float) -> None:
        self._checked = now
        self._left = MAX_HELD

    @property
    def is_full(self) -> bool:
        """True if nothing of it is used."""
        return self._left >= MAX_HELD

    def hold(self, now: float, *, is_wanted: bool) -> bool:
        """Return whether time stands until the next call; call it regularly, even while no hold is wanted."""
        passed, self._checked = min(now - self._checked, _MAX_LOOK_INTERVAL), now
        if is_wanted and self._left > 0.0:
            self._left -= passed
            return True
        self._left = min(MAX_HELD, self._left + REGAIN_RATE * passed)
        return False


class ClientConnection:
    """Connection of a client that is not trusted: it may not read, not send, or send nonsense."""

    def __init__(self, connection: socket.socket, host: str) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.connection = connection
        self.host = host
        self.node = ""  # its name; empty before HELLO
        self.encoding = ""  # of its messages: `cdr`, `ros1` or `ros2`
        self.has_key = False  # true if it has shown the server's key
        self.wants_notices = False  # true if it asked for NOTICE frames
        self.subscriptions: dict[int, Callable[[], None]] = {}  # functions that end them, by number
        self.has_news = False
        """True if a message that is not quiet was sent to it since the answer to its last ADVANCE."""
        self.dropped = 0  # messages dropped since the last report
        self.full = FULL  # waiting bytes from which on its messages are dropped
        self.is_heavy = False  # true if its last request took long
        self.heartbeat: Heartbeat | None = None  # measures its delay; None unless it asked for PINGs
        self.missed: Counter[str] = Counter()  # reasons of messages that it could not get, since the last report
        self.is_gone = False  # nothing more can be sent or received
        self.is_leaving = False
        """Nothing more is read from it; it is gone as soon as it has taken what waits for it."""
        self.came = time.monotonic()  # wall time of its connection [s]
        self.stuck_since: float | None = None
        """Wall time [s] since which it takes nothing of what waits for it; None if it does."""
        self._decoder = Decoder(MAX_HELLO_BYTES)
        self._frames: Iterator[Frame] | None = None
        self._out = bytearray()
        self._left = 0  # bytes of it that were offered and not taken

    @property
    def name(self) -> str:
        """Name for reports."""
        return self.node or f"a connection from {self.host}"

    @property
    def has_waiting(self) -> bool:
        """True if bytes wait to be sent."""
        return bool(self._out)

    @property
    def is_idle(self) -> bool:
        """True if nothing is to be done for it until it sends something; one that answers PINGs never is."""
        return not (self._out or self._frames is not None or self.is_gone or self.is_leaving or self.heartbeat)

    @property
    def incomplete_bytes(self) -> int:
        """Bytes of its incomplete frame."""
        return self._decoder.incomplete_bytes

    @property
    def is_behind(self) -> bool:
        """True if so much waits for it that it has to read first."""
        return len(self._out) >= BEHIND

    @property
    def has_frames(self) -> bool:
        """True if the bytes that were read may contain frames to carry out."""
        return self._frames is not None and not self.is_behind

    @property
    def may_be_read(self) -> bool:
        """True if more may be read from it: all earlier frames are done, and it takes what it is sent."""
        return self._frames is None and not (self.is_leaving or self.is_gone or self.is_behind)

    def greet(self, node: str, encoding: str) -> None:
        """Set its name and encoding, and accept longer frames from now on."""
        self.node, self.encoding = node, encoding
        self._decoder.max_bytes = MAX_CLIENT_FRAME_BYTES

    def read(self) -> None:
        """Read what has arrived. A client that has hung up is gone."""
        try:
            data = self.connection.recv(_PIECE)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if data:
            self._frames = self._decoder.feed(data)
        else:
            self.is_gone = True

    def next_frame(self) -> Frame | None:
        """Return the next received frame; None if none is complete. A FrameError if it is invalid."""
        frame = None if self._frames is None or self.is_behind else next(self._frames, None)
        if frame is None and not self.is_behind:
            self._frames = None
        return frame

    def send(self, frame: Frame) -> None:
        """Send a frame, behind what waits already."""
        self._out += frame.encode()

    def send_message(self, number: int, message: bytes, *, is_quiet: bool) -> None:
        """Send a message of a subscription; drop and count it if the client does not keep up."""
        if self._left >= self.full or len(self._out) - self._left >= AT_ONCE:
            self.dropped += 1
            return
        self.send(Frame(FrameKind.MESSAGE, number, payload=message))
        self.has_news = self.has_news or not is_quiet

    def flush(self) -> None:
        """Send as much of what waits as the client takes now."""
        if self._out and not self.is_gone:
            try:
                sent = self.connection.send(self._out)
            except (BlockingIOError, InterruptedError):
                sent = 0
            except OSError:
                self.is_gone = True
                return
            del self._out[:sent]
            self._left = len(self._out)
            if sent:
                self.stuck_since = None
            elif self.stuck_since is None:
                self.stuck_since = time.monotonic()
        if self.is_leaving and not self._out:
            self.is_gone = True

    def stop_reading(self) -> None:
        """Read nothing more from it; it leaves once it has taken what waits for it."""
        self.is_leaving = True
        self._frames = None
        self._decoder = Decoder(0)
        self.flush()

    def close(self) -> None:
        """End all subscriptions, and close the connection."""
        self.is_gone = True
        for cancel in self.subscriptions.values():
            cancel()
        self.subscriptions.clear()
        self.connection.close()


def refused_frame(number: int, error: BaseException, said: str | None = None) -> Frame:
    """Return the REFUSED answer to a request, with the nearest class of error that every client knows.

    Args:
        number: of the request.
        error: its text is the reason.
        said: addition of the report to the reason; None if it was only counted.
    """
    kinds = type(error).__mro__
    known = next((kind for kind in kinds if kind.__module__ == errors.__name__), CellwrightError)
    reason = str(error).encode(errors="replace")
    return Frame(FrameKind.REFUSED, number, known.__name__, "" if said is None else SAID, said or "", reason)


class ClientRegistry:
    """Registry of connected clients, in the order of connection.

    Args:
        report: takes a line about clients that misbehave, at most one a second for each.
        forget: takes each client that is gone.
    """

    def __init__(self, report: Callable[[str], None], forget: Callable[[ClientConnection], None]) -> None:
        self._report = report
        self._forget = forget
        self._clients: list[ClientConnection] = []
        self._disconnected: dict[str, Counter[str]] = {}
        self._reported_late: set[str] = set()
        self._checked = time.monotonic()
        self._hold_budget = HoldBudget(self._checked)

    def __iter__(self) -> Iterator[ClientConnection]:
        return iter(self._clients)

    def __len__(self) -> int:
        return len(self._clients)

    def from_turn(self, turn: int) -> list[ClientConnection]:
        """Return all clients once, beginning with the one whose turn it is."""
        first = turn % len(self._clients) if self._clients else 0
        return [*self._clients[first:], *self._clients[:first]]

    def admit(self, client: ClientConnection) -> None:
        """Add a client; if there are too many, another one may have to leave."""
        self._clients.append(client)
        self._share_room()
        if len(self._clients) > MAX_CLIENTS:
            # a client without a HELLO makes room: silent connections must not keep programs out
            silent = next((each for each in self._clients if not each.node and not each.is_leaving), client)
            self.cut(silent, FrameError(f"the server already has {MAX_CLIENTS} clients"))

    def cut(self, client: ClientConnection, error: FrameError) -> None:
        """Send a client the reason why nothing more is read from it; it leaves once it has taken it."""
        client.send(refused_frame(0, error))
        client.stop_reading()
        self._note_cut(client, str(error))

    def remove_gone(self) -> None:
        """Remove clients that are gone; the others share their room."""
        for client in [client for client in self._clients if client.is_gone]:
            self._clients.remove(client)
            self._forget(client)
            client.close()
        self._share_room()

    def close(self) -> None:
        """Disconnect all clients."""
        self._report_cut_off()
        for client in self._clients:
            client.close()
        self._clients.clear()

    def _share_room(self) -> None:
        """Set each client's share of the bytes that may wait for all."""
        for client in self._clients:
            client.full = min(FULL, MAX_WAITING // len(self._clients))

    def ping(self) -> None:
        """Send the PINGs that are due."""
        now = time.monotonic()
        for client in self._clients:
            if client.heartbeat is not None and not client.is_leaving and (number := client.heartbeat.ping(now)):
                client.send(Frame(FrameKind.PING, number))

    def hold_time(self) -> bool:
        """Return whether simulation time stands for clients that are behind; report the first time that it does."""
        if self._hold_budget.is_full:
            for client in self._clients:
                if client.heartbeat is not None:
                    break
            else:
                return False  # as in most ticks of most runs
        now = time.monotonic()
        late = [client for client in self._clients if client.heartbeat is not None and client.heartbeat.is_late(now)]
        late = [client for client in late if not client.is_leaving and not client.is_gone]
        if not self._hold_budget.hold(now, is_wanted=bool(late)):
            return False
        for client in late:
            if client.name not in self._reported_late and len(self._reported_late) < _MAX_NAMED:
                self._reported_late.add(client.name)
                late_one = _BRIDGES.get(client.encoding, client.name)
                self._report(f"time stands while {late_one} is more than {LATE:g} s behind (reported once)")
        return True

    def tell(self, line: str) -> None:
        """Send a line to the clients that asked for notices."""
        for client in self._clients:
            if client.wants_notices and not client.is_leaving and not client.is_gone:
                client.send(Frame(FrameKind.NOTICE, payload=line.encode(errors="replace")))

    def limit_incomplete(self) -> None:
        """Disconnect clients with the largest incomplete frames until all together are within `MAX_INCOMPLETE`."""
        while sum(client.incomplete_bytes for client in self._clients) > MAX_INCOMPLETE:
            greatest = max(self._clients, key=lambda client: client.incomplete_bytes)
            self.cut(greatest, FrameError("incomplete frames of all clients are too long"))

    @property
    def next_check(self) -> float:
        """Time [s] until the next check of the clients."""
        return max(0.0, self._checked + _CHECK_PERIOD - time.monotonic())

    def check(self) -> None:
        """Once a second: report what happened to clients, and disconnect those that are stuck or silent."""
        now = time.monotonic()
        if now - self._checked < _CHECK_PERIOD:
            return
        self._checked = now
        for client in self._clients:
            if client.dropped:
                self._report(f"client {client.name} is too slow: {client.dropped} messages dropped")
                client.dropped = 0
            if client.missed:
                self._report(f"cannot send to {client.name}: {_first(client.missed)}")
                client.missed.clear()
            is_stuck = client.stuck_since is not None and now - client.stuck_since > SLOW_CLIENT_TIMEOUT
            if is_stuck and (client.is_behind or client.is_leaving):
                client.is_gone = True
                self._note_cut(client, f"it read nothing for {SLOW_CLIENT_TIMEOUT:g} s")
            elif not client.node and not client.is_leaving and now - client.came > SLOW_CLIENT_TIMEOUT:
                self.cut(client, FrameError(f"no HELLO within {SLOW_CLIENT_TIMEOUT:g} s"))
        self._report_cut_off()

    def _report_cut_off(self) -> None:
        for name, reasons in self._disconnected.items():
            self._report(f"disconnected {name}: {_first(reasons)}")
        self._disconnected.clear()

    def _note_cut(self, client: ClientConnection, reason: str) -> None:
        """Note a disconnected client for the next report; beyond some names, the others share a line."""
        name = client.name if client.name in self._disconnected or len(self._disconnected) < _MAX_NAMED else "others"
        self._disconnected.setdefault(name, Counter())[reason] += 1


def _first(reasons: Counter[str]) -> str:
    """Return the first of many reasons, and the number of further ones."""
    more = reasons.total() - 1
    return next(iter(reasons)) + (f" (and {more} more since the last report)" if more else "")
