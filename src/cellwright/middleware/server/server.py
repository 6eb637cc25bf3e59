"""Server of a bus on a TCP socket: listening, reading and writing in the simulation's thread.

One thread does everything. The loop that steps the cell calls `wait` between two ticks, which carries out the commands
that arrive. It checks the time after every frame, so that a flood of frames uses idle time only.
"""

import errno
import os
import secrets
import select
import socket
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from ipaddress import ip_address

from cellwright.middleware.bus import Node
from cellwright.middleware.server.clients import ClientConnection, ClientRegistry, refused_frame
from cellwright.middleware.server.requests import AdvanceRequest, Extra, Requests
from cellwright.middleware.wire.frames import Frame, FrameError, FrameKind
from cellwright.util.errors import UsageError

_EXHAUSTED = frozenset({errno.EMFILE, errno.ENFILE})
DEFAULT_PORT = 11399
TRIES = 20  # number of ports to try from the default one on, if it is in use
LOOPBACK = "127.0.0.1"
_END_TIMEOUT = 0.5  # [s] for clients to read that the server ends
_HEAVY_TIME = 0.02  # [s]: a request that takes longer is heavy, and time does not pass meanwhile
_HEAVY_PAUSE = 3  # pause before the next heavy request, as a multiple of the time that the last one took
_FRAMES_A_TURN = 16
_LARGE_INCOMPLETE = 1 << 16  # bytes of an incomplete frame
_MAX_DESCRIPTORS = 1024  # `select` can watch no more


def open_listener(host: str, port: int, *, tries: int = 1, backlog: int = 64) -> socket.socket:
    """Return a socket that listens at an address of this machine.

    Args:
        host: name or address.
        port: 0 takes a free one.
        tries: number of ports to try, from `port` upward, if it is in use.
        backlog: number of connections that may wait to be accepted.

    Raises:
        UsageError: the socket cannot listen at the address.
    """
    if not 0 <= port <= 65535:
        raise UsageError(f"port must be from 0 to 65535, not {port}")
    for candidate in range(port, min(port + (tries if port else 1), 65536)):
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, candidate, type=socket.SOCK_STREAM)[0]
            listener = socket.socket(family, kind, protocol)
        except OSError as error:
            raise UsageError(f"{host}: cannot listen: {error.strerror or error}") from None
        try:
            # On Windows this option would let two servers share a port.
            if os.name == "posix":
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen(backlog)
        except OSError as error:
            listener.close()
            reason = error.strerror or str(error)
        else:
            return listener
    raise UsageError(f"{host}:{port}: cannot listen: {reason}")


class ListeningSocket:
    """Listening socket that rejects connections when the process has no more descriptors.

    A connection that is not accepted stays in the queue, and `select` reports the socket as readable without end. So
    the listener reserves one descriptor, with which it accepts and closes such a connection. `close` closes the socket.
    """

    def __init__(self, listener: socket.socket) -> None:
        listener.setblocking(False)
        self.socket = listener
        self._spare: int | None = None
        self._reserve()

    def accept(self) -> tuple[socket.socket, str] | None:
        """Return the next connection and its host; None if there is none, or it was rejected."""
        if self._spare is None:
            self._reserve()
        try:
            connection, address = self.socket.accept()
        except OSError as error:
            if error.errno in _EXHAUSTED:
                self._release()
                with suppress(OSError):  # the connection has gone, or another thread took the descriptor
                    self.socket.accept()[0].close()
                self._reserve()
            return None
        return connection, str(address[0])

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()
        self._release()

    def _reserve(self) -> None:
        try:
            self._spare = os.open(os.devnull, os.O_RDONLY)
        except OSError:
            self._spare = None

    def _release(self) -> None:
        if self._spare is not None:
            os.close(self._spare)
            self._spare = None


class Server:
    """Server of a cell's bus on a TCP socket.

    Args:
        cell: node with the bus.
        host: address to listen at; anything but loopback lets others in the network drive the cell.
        port: 0 takes a free one, None the default one, or one of the next if that is in use.
        lockstep: advance time only on clients' requests.
        report: takes a line about clients that misbehave, at most one a second for each.

    Raises:
        UsageError: the server cannot listen at the address.
    """

    def __init__(
        self,
        cell: Node,
        *,
        host: str = LOOPBACK,
        port: int | None = DEFAULT_PORT,
        lockstep: bool = False,
        report: Callable[[str], None] = lambda _line: None,
    ) -> None:
        found = open_listener(host, port) if port is not None else open_listener(host, DEFAULT_PORT, tries=TRIES)
        self._listener = ListeningSocket(found)
        # the default port if it was requested and in use; else 0
        self.busy_port = DEFAULT_PORT if port is None and self.address[1] != DEFAULT_PORT else 0
        self.key = ""  # opens guarded services to a client that shows it; empty while there are none
        self._requests = Requests(cell, lockstep=lockstep)
        self._streams = self._requests.streams
        self._clients = ClientRegistry(report, self._requests.forget)
        self._notices, self._tell = cell.bus.on_notice, self._clients.tell
        self._notices.append(self._tell)
        self._turn = 0
        self._rests_until = 0.0
        self.lockstep = lockstep

    @property
    def address(self) -> tuple[str, int]:
        """Host and port of the listening socket."""
        host, port = self._listener.socket.getsockname()[:2]
        return str(host), int(port)

    @property
    def is_local(self) -> bool:
        """True if only programs on this machine can reach it."""
        return ip_address(self.address[0]).is_loopback

    @property
    def clients(self) -> tuple[str, ...]:
        """Names of the connected nodes."""
        return tuple(client.node for client in self._clients if client.node)

    @property
    def advance_request(self) -> AdvanceRequest | None:
        """In lockstep: the next pending ADVANCE request; None if there is none."""
        pending = self._requests.pending
        while pending and pending[0].client.is_gone:
            pending.popleft()
        return pending[0] if pending else None

    def answer(self, request: AdvanceRequest, refused: BaseException | None = None) -> None:
        """In lockstep: answer a request with the current time, or with the error that stops time."""
        if request in self._requests.pending:
            self._requests.pending.remove(request)
        if refused is None:
            self._requests.answer(request)
        else:
            request.client.send(refused_frame(request.number, refused))

    def offer(self, service: str, handler: Extra, *, acts: bool = False) -> None:
        """Offer a service of the server itself, which is not on the bus.

        Args:
            service: name.
            handler: takes a JSON object; returns one, a tuple of one and bytes, or a stream of such tuples.
            acts: it changes the cell; note its calls like commands (`Bus.on_input`).
        """
        self._requests.extras[service] = handler, acts

    def guard(self, services: Iterable[str], reason: str) -> None:
        """Restrict services of the server to clients that have shown the key; all others get the reason.

        The first call draws the key: clients that are already connected do not have it.
        """
        if not self.key:
            self.key = self._requests.key = secrets.token_urlsafe(16)
        self._requests.guarded.update(dict.fromkeys(services, reason))

    def wait(self, seconds: float, *, until_request: bool = True) -> bool:
        """Serve clients for some wall time.

        Args:
            seconds: wall time [s]; with 0 each client still has its turn.
            until_request: in lockstep, return as soon as an ADVANCE request is pending.

        Returns:
            True if a client sent or was sent something.
        """
        now = time.perf_counter()
        deadline = now + seconds
        if self._streams.serve(now, seconds):
            seconds = deadline - time.perf_counter()
        if deadline < self._streams.due and self._nap(seconds):
            return False
        self._clients.ping()
        is_busy = any(client.has_waiting or client.has_frames for client in self._clients)
        self._flush()
        while True:
            until = deadline
            if any(client.has_frames for client in self._clients):
                ready = any(map(self._is_ready, self._clients))
                until = 0.0 if ready else min(deadline, self._rests_until)
            left = max(0.0, min(until, self._streams.due) - time.perf_counter())
            is_busy |= self._look_at_sockets(min(left, self._clients.next_check))
            in_time = self._take_turns(deadline)
            self._streams.serve(time.perf_counter(), 0.0)
            self._clients.check()
            if (
                not in_time
                or time.perf_counter() >= deadline
                or (until_request and self.lockstep and self.advance_request is not None)
            ):
                break
        self._clients.remove_gone()
        return is_busy

    @property
    def is_client_behind(self) -> bool:
        """True if a client has to read before it can get more without loss."""
        return any(client.is_behind and not client.is_gone for client in self._clients)

    def hold_time(self) -> bool:
        """Return whether simulation time stands, out of lockstep, for a client that is behind, such as a bridge."""
        return self._clients.hold_time()

    def dismiss(self, reason: str, *, keep: Callable[[str], bool]) -> None:
        """Send clients the reason of the end, and read no more from them, except those whose names `keep` accepts."""
        for client in self._clients:
            if client.node and not keep(client.node) and not client.is_gone:
                client.send(Frame(FrameKind.ENDED, payload=reason.encode()))
                client.stop_reading()
        deadline = time.monotonic() + _END_TIMEOUT
        while any(client.is_leaving and not client.is_gone for client in self._clients) and time.monotonic() < deadline:
            self.wait(_END_TIMEOUT / 10, until_request=False)
        self._clients.remove_gone()

    def close(self, reason: str) -> None:
        """Send every client the reason of the end, and disconnect all."""
        self._listener.close()
        if self._tell in self._notices:
            self._notices.remove(self._tell)
        for client in self._clients:
            if client.node and not client.is_gone:
                client.send(Frame(FrameKind.ENDED, payload=reason.encode()))
        deadline = time.monotonic() + _END_TIMEOUT
        while time.monotonic() < deadline:
            self._flush()
            behind = [client.connection for client in self._clients if client.has_waiting and not client.is_gone]
            if not behind:
                break
            select.select((), behind, (), 0.05)
        self._clients.close()

    def _nap(self, seconds: float) -> bool:
        """Wait while nothing is to be done for any client; False, maybe at once, if there is something.

        A tick of real time needs no more than this, so it takes hardly longer than to sleep.
        """
        watched = [self._listener.socket]
        for client in self._clients:
            if not client.is_idle:
                return False
            watched.append(client.connection)
        return 0.0 < seconds < self._clients.next_check and not select.select(watched, (), (), seconds)[0]

    def _look_at_sockets(self, timeout: float) -> bool:
        """Wait until a socket is ready; read what arrived, and send what waits. Return True if one was ready."""
        listener = self._listener.socket
        read = {client.connection: client for client in self._clients if client.may_be_read}
        write = {client.connection: client for client in self._clients if client.has_waiting and not client.is_gone}
        readable, writable, _ = select.select([listener, *read], list(write), (), timeout)
        for connection in writable:
            write[connection].flush()
        for connection in readable:
            if connection is listener:
                self._accept()
            else:
                read[connection].read()
                if read[connection].incomplete_bytes > _LARGE_INCOMPLETE:
                    self._clients.limit_incomplete()
        if readable or writable:
            self._clients.remove_gone()
            return True
        return False

    def _accept(self) -> None:
        """Accept a connection, if there is room."""
        accepted = self._listener.accept()
        if accepted is None:
            return
        connection, host = accepted
        if os.name == "posix" and connection.fileno() >= _MAX_DESCRIPTORS:
            connection.close()
            return
        try:
            self._clients.admit(ClientConnection(connection, host))
        except OSError:  # already closed
            connection.close()

    def _take_turns(self, deadline: float) -> bool:
        """Carry out received frames, client by client; False if time ran out before all had a turn."""
        in_turn = self._clients.from_turn(self._turn)
        for done, client in enumerate(in_turn, 1):
            if self._is_ready(client):
                self._serve(client, deadline)
                client.flush()
                if time.perf_counter() >= deadline and done < len(in_turn):
                    self._turn = (self._turn + done) % len(in_turn)
                    return False
        return True

    def _serve(self, client: ClientConnection, deadline: float) -> None:
        try:
            for _ in range(_FRAMES_A_TURN):
                frame = client.next_frame()
                if frame is None:
                    return
                started = time.perf_counter()
                self._requests.carry_out(client, frame)
                now = time.perf_counter()
                client.is_heavy = now - started > _HEAVY_TIME
                if client.is_heavy:
                    self._rests_until = now + _HEAVY_PAUSE * (now - started)
                if now >= deadline or client.is_heavy:
                    return
        except FrameError as error:
            self._clients.cut(client, error)

    def _is_ready(self, client: ClientConnection) -> bool:
        """True if frames of a client may be carried out now.

        Clients with heavy requests wait between them, so that all such clients together get a part of the time. In
        lockstep time stands anyway.
        """
        rests = client.is_heavy and not self.lockstep and time.perf_counter() < self._rests_until
        return client.has_frames and not rests

    def _flush(self) -> None:
        for client in self._clients:
            client.flush()
