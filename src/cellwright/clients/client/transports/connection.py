"""A connection to what serves a cell: frames out, frames in, each question with its answer."""

from __future__ import annotations

import itertools
import select
import socket
from collections.abc import Callable
from contextlib import suppress

from cellwright.middleware.wire.frames import LONGEST_SAID, Decoder, Frame, FrameError, Kind, hello
from cellwright.util import errors
from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError, UsageError, showable

_PIECE = 1 << 18
_SMALL = 1 << 14  # bytes that the system takes at once, for a cell that reads now and then
_LOOK = 0.5  # [s]; on Windows a Ctrl-C is not heard while a process waits for a socket


class Connection:
    """Asks and listens. What is not an answer is handed to `on_frame` as it comes.

    Args:
        address: host and port.
        node: the name by which the other end knows this one.
        encoding: the form of messages, `cdr` or `ros1`.
        on_frame: takes messages.
        timeout: how long [s] to wait for the other end to take the connection and to greet.
        key: the key of the server at the other end, for its own page.

    Raises:
        UsageError: nobody answers there, or it is no cell.
    """

    def __init__(
        self,
        address: tuple[str, int],
        *,
        node: str,
        encoding: str,
        on_frame: Callable[[Frame], None],
        timeout: float = 10.0,
        key: str = "",
    ) -> None:
        where = f"{address[0]}:{address[1]}"
        try:
            self._socket = socket.create_connection(address, timeout=timeout)
        except (OSError, OverflowError) as error:
            raise UsageError(f"nobody answers at {where}: {getattr(error, 'strerror', None) or error}") from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.setblocking(True)
        self._decoder = Decoder()
        self._numbers = itertools.cycle(range(1, 1 << 32))
        self._on_frame = on_frame
        self._awaited = 0
        self._answers: list[Frame] = []
        self._promised: dict[int, Frame | None] = {}
        self._end: str | None = None
        try:
            self._send(hello(node, encoding, key).encode())
            self.welcome = self._await_answer(0, timeout).json()
            """What the cell says of itself, its topics and its services."""
        except (RunEndedError, FrameError) as error:
            self.close()
            raise UsageError(f"nobody answers at {where}: {error}") from None

    def number(self) -> int:
        """A number for a question or a subscription that is not in use."""
        return next(self._numbers)

    def ask(self, frame: Frame) -> Frame:
        """Send a frame and wait for its answer.

        Raises:
            CellwrightError: it was refused; of the class that says why.
            RunEndedError: there is no more answer to be had, or no more time.
        """
        self.say(frame)
        answer = self._await_answer(frame.number)
        if answer.kind is Kind.REFUSED:
            raise _error(answer)
        return answer

    def promise(self, number: int) -> None:
        """Keep another answer to a question that has been answered already, for `promised`."""
        came = [frame for frame in self._answers[1:] if frame.number == number]  # right behind the first one
        self._promised[number] = came[0] if came else None

    def promised(self, number: int) -> Frame | None:
        """That answer; None while it has not come.

        Raises:
            CellwrightError: it was refused; of the class that says why.
        """
        answer = self._promised[number]
        if answer is not None:
            del self._promised[number]
            if answer.kind is Kind.REFUSED:
                raise _error(answer)
        return answer

    def say(self, frame: Frame) -> None:
        """Send a frame that has no answer, or whose answer is nobody's concern.

        Raises:
            RunEndedError: nobody is there to take it.
        """
        if self._end is not None:
            raise RunEndedError(self._end)
        try:
            data = frame.encode(LONGEST_SAID)
        except FrameError as error:
            raise UsageError(str(error)) from None
        self._send(data)

    def listen(self, timeout: float | None) -> bool:
        """Take in what has come; wait for something, so long at most [s] (None: for ever). Whether something came.

        Raises:
            RunEndedError: nothing can come any more.
        """
        if self._end is not None:
            raise RunEndedError(self._end)
        try:
            while not select.select([self._socket], (), (), _LOOK if timeout is None else timeout)[0]:
                if timeout is not None:
                    return False
        except (OSError, ValueError):  # another thread has hung up meanwhile
            if self._end is None:
                raise
            raise RunEndedError(self._end) from None
        self._read()
        return True

    def close(self) -> None:
        """Hang up."""
        self._end = self._end or "the connection was closed"
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)  # a thread that listens is not left waiting
        self._socket.close()

    # ---------------------------------------------------------------- bytes

    def _await_answer(self, number: int, timeout: float | None = None) -> Frame:
        self._awaited = number
        self._answers.clear()
        while not self._answers:
            if not self.listen(timeout):
                raise RunEndedError(f"nothing has come for {timeout:g} s")
        return self._answers[0]

    def _send(self, data: bytes) -> None:
        try:
            if len(data) <= _SMALL:
                self._socket.sendall(data)
            else:
                self._send_much(data)
        except (OSError, ValueError):  # the second where another thread has hung up meanwhile
            self._is_over("the server is gone")
            raise RunEndedError(self._end) from None

    def _send_much(self, data: bytes) -> None:
        """Send what the system may not take at once; what comes meanwhile is read, so that neither end waits."""
        rest = memoryview(data)
        self._socket.setblocking(False)
        try:
            while rest and self._end is None:
                readable, writable, _ = select.select([self._socket], [self._socket], (), _LOOK)
                if readable:
                    self._read()
                if writable:
                    rest = rest[self._socket.send(rest) :]
        finally:
            self._socket.setblocking(True)

    def _read(self) -> None:
        try:
            data = self._socket.recv(_PIECE)
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            data = b""
        if not data:
            self._is_over("the server is gone")
            return
        try:
            for frame in self._decoder.feed(data):
                self._take(frame)
        except FrameError as error:
            self._is_over(f"what answers there is no cell: {error}")

    def _take(self, frame: Frame) -> None:
        match frame.kind:
            case Kind.MESSAGE:
                self._on_frame(frame)
            case Kind.ENDED:
                self._is_over(showable(frame.text()))
            case Kind.REFUSED if frame.number == 0:
                self._is_over(showable(frame.text()))
            case _ if frame.number in self._promised:
                self._promised[frame.number] = frame
            case _ if frame.number == self._awaited:
                self._answers.append(frame)
            case _:  # the answer to what somebody stopped waiting for
                pass

    def _is_over(self, reason: str) -> None:
        self._end = self._end or reason


class _ToldUnknownNameError(UnknownNameError):
    """An unknown name that the other end told of in a sentence."""

    def __init__(self, sentence: str) -> None:
        self._sentence = sentence
        super().__init__("name", "", ())

    def sentence(self) -> str:
        return self._sentence


def _error(answer: Frame) -> BaseException:
    """The error that a refusal stands for, of a class that this process knows."""
    found = getattr(errors, answer.name, CellwrightError)
    if found is UnknownNameError:
        return _ToldUnknownNameError(showable(answer.text()))
    if not isinstance(found, type) or not issubclass(found, (CellwrightError, RunEndedError)):
        found = CellwrightError
    return found(showable(answer.text()))
