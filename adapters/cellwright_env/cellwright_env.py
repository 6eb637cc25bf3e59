"""Environments of Cellwright for programs that do not have its packages: this file, NumPy and websockets.

`RemoteEnv` starts `cellwright env serve` with the Python that has Cellwright, and works as an environment of Gymnasium:

    env = RemoteEnv("pick_from_bin", python="/opt/cellwright/bin/python")
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(observation["agent_pos"])
    env.close()

One server has one environment, and ends with its program.
"""

from __future__ import annotations

import inspect
import os
import re
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from websockets.exceptions import ConnectionClosed, WebSocketException
from websockets.sync.client import connect

PROTOCOL = 1
"""Version of the protocol that this file speaks."""

_ADDRESS = re.compile(r"ws://\S+")
_ENDING = 5.0  # [s]: an action is done until then
# MessagePack's first bytes, by its specification of 2017, with the signs of `struct`
_INTEGERS = (("B", 0xCC), ("H", 0xCD), ("I", 0xCE), ("Q", 0xCF), ("b", 0xD0), ("h", 0xD1), ("i", 0xD2), ("q", 0xD3))
_NUMBERS = {0xCA: "f", 0xCB: "d", **{head: sign for sign, head in _INTEGERS}}
_SIZES = {0xC4: "B", 0xC5: "H", 0xC6: "I", 0xD9: "B", 0xDA: "H", 0xDB: "I"}
_COUNTS = {0xDC: "H", 0xDD: "I", 0xDE: "H", 0xDF: "I"}


class EnvError(RuntimeError):
    """The server refuses, is gone, or cannot be started.

    Attributes:
        kind: `request`: nothing has happened; `episode`: the episode cannot go on; `busy`: another client is connected;
            `connection`: the server is gone, late or none.
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


class RemoteEnv:
    """Environment of a task, in a process of Cellwright's own; close it at the end.

    Args:
        task: name of a bundled trial with a task, or a trial's file; with `address`, the name of one of its tasks.
        address: `ws://HOST:PORT` of a server that runs, whose own options hold in place of the arguments after
            `timeout`. None: start a server, and end it with `close`, or with this process.
        python: the Python that has Cellwright, to start a server with; None: the one of this process.
        timeout: bound of the start and of each reply [s].
        rate: control periods in a second [Hz].
        control: `absolute` or `delta`.
        cameras: names of the cameras whose pictures are observed.
        privileged: True to observe `environment_state`, which no real sensor tells.

    Attributes:
        description: description of the environment by its server: names, units and bounds of actions, and observations.
        task: name of the task.
        task_description: its sentence.
        metadata: `render_modes` and `render_fps`, as of Gymnasium.

    Raises:
        EnvError: there is no server, it cannot be started, or it refuses.
    """

    def __init__(
        self,
        task: str,
        *,
        address: str | None = None,
        python: str | None = None,
        timeout: float = 300.0,
        rate: float = 20.0,
        control: str = "absolute",
        cameras: Sequence[str] = (),
        privileged: bool = True,
    ) -> None:
        self._timeout = timeout
        self._process: subprocess.Popen[bytes] | None = None
        self._log: Any = None
        self._connection: Any = None
        try:
            hello: dict[str, Any] = {"type": "hello", "task": task}
            if address is None:
                hello["task"] = None
                arguments = [task, f"--rate={rate!r}", f"--control={control}"]
                arguments += [f"--cameras={','.join(cameras)}"] if cameras else []
                arguments += [] if privileged else ["--no-privileged"]
                address = self._started(python or sys.executable, arguments)
            self._connection = _connected(address, timeout)
            self._describe(self._ask(hello))
        except BaseException:
            self.close()
            raise

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode; return its first observation, and `info` with `is_success` and `time` [s].

        Args:
            seed: seed of the episode: equal seeds and actions are equal episodes, bit for bit.
            options: `variation` and `joints`; others are ignored.
        """
        chosen = None if seed is None else int(seed)
        reply = self._ask({"type": "reset", "seed": chosen, "options": dict(options or {})})
        return reply["observation"], reply["info"]

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Apply an action (D,) for a control period; return observation, reward, terminated, truncated and info."""
        numbers = np.asarray(action)
        if numbers.ndim != 1:
            raise EnvError("request", f"action: must have one axis (got {numbers.ndim}); see step_chunk")
        reply = self._ask({"type": "step", "action": numbers})
        return reply["observation"], reply["reward"], reply["terminated"], reply["truncated"], reply["info"]

    def step_chunk(self, actions: Any) -> tuple[dict[str, Any], np.ndarray, bool, bool, dict[str, Any]]:
        """Apply the actions (H, D) until the episode is over; return as `step` does, with a reward for each applied."""
        numbers = np.asarray(actions)
        if numbers.ndim != 2:
            raise EnvError("request", f"actions: must have two axes (got {numbers.ndim}); see step")
        reply = self._ask({"type": "step", "action": numbers})
        return reply["observation"], reply["rewards"], reply["terminated"], reply["truncated"], reply["info"]

    def render(self) -> np.ndarray:
        """Return a picture of the whole cell: height x width x 3, uint8."""
        picture: np.ndarray = self._ask({"type": "render"})["picture"]
        return picture

    def close(self) -> None:
        """Leave the server, and end it if this environment has started it; a second call does nothing."""
        connection, self._connection = self._connection, None
        if connection is not None:
            with suppress(OSError, WebSocketException):
                connection.close()
        process, self._process = self._process, None
        if process is not None:
            process.stdin.close()  # type: ignore[union-attr]  # a pipe
            try:
                process.wait(_ENDING)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            process.stdout.close()  # type: ignore[union-attr]  # a pipe
        log, self._log = self._log, None
        if log is not None:
            log.close()

    def __enter__(self) -> RemoteEnv:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _describe(self, description: dict[str, Any]) -> None:
        if description["protocol"] != PROTOCOL:
            version = description["protocol"]
            raise EnvError("connection", f"the server speaks protocol {version}, this file {PROTOCOL}; update one")
        self.description = description
        self.task, self.task_description = description["task"], description["sentence"]
        self._max_episode_steps = description["max_steps"]  # where LeRobot reads it
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": description["rate"]}

    def _started(self, python: str, arguments: list[str]) -> str:
        """Start a server; return its address."""
        command = [python, "-m", "cellwright", "env", "serve", *arguments, "--exit-with-stdin"]
        environment = dict(os.environ)
        if python != sys.executable:  # the packages of this Python are none of that one's
            for name in ("PYTHONPATH", "PYTHONHOME"):
                environment.pop(name, None)
        self._log = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the server
        try:
            # in a session of its own: a Ctrl-C on the terminal is for this program
            self._process = process = subprocess.Popen(  # noqa: S603
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._log,
                env=environment,
                start_new_session=os.name == "posix",
            )
        except OSError as error:
            raise EnvError("connection", f"{python}: cannot be started ({error.strerror})") from None
        late = threading.Timer(self._timeout, process.kill)
        late.start()
        try:
            lines = (line.decode(errors="replace") for line in process.stdout)  # type: ignore[union-attr]  # a pipe
            address = next((found.group() for found in map(_ADDRESS.search, lines) if found), "")
        finally:
            late.cancel()
        if not address:
            process.wait()
            said = self._said() or f"not ready within {self._timeout:g} s"
            raise EnvError("connection", f"cellwright env serve: {said}")
        return address

    def _said(self) -> str:
        """Return the last lines that the server has written to its stderr."""
        if self._log is None:
            return ""
        self._log.seek(0)
        said: str = self._log.read()[-4000:].decode(errors="replace").strip()
        return said

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        if self._connection is None:
            raise EnvError("connection", "the environment is closed, or its server is gone; make another")
        try:
            frame = pack(request)
        except (TypeError, ValueError, struct.error) as error:
            raise EnvError("request", f"{request['type']}: cannot be sent ({error})") from None
        try:
            self._connection.send(frame)
            received = self._connection.recv(self._timeout)
        except TimeoutError:
            self.close()
            raise EnvError("connection", f"no reply within {self._timeout:g} s") from None
        except (ConnectionClosed, OSError) as error:
            said = self._said()
            self.close()
            raise EnvError("connection", f"the server is gone: {said or error}") from None
        except BaseException:
            self.close()  # the reply to come would be taken for that of the next request
            raise
        reply: dict[str, Any] = unpack(received)
        if reply["type"] == "error":
            raise EnvError(reply["kind"], reply["error"])
        return reply


def pack(value: Any) -> bytes:
    """Return a value as MessagePack, with arrays in OpenPI's form.

    Args:
        value: None, booleans, numbers, text, bytes, lists, maps, and arrays and scalars of numpy.

    Raises:
        TypeError: another type.
        ValueError: an array of other elements than plain numbers.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray):
        if value.dtype.kind not in "biuf":
            raise ValueError(f"an array of {value.dtype}")
        fields = {b"__ndarray__": True, b"data": value.tobytes(), b"dtype": value.dtype.str, b"shape": value.shape}
        return pack(fields)
    if value is None or isinstance(value, bool):
        return {None: b"\xc0", False: b"\xc2", True: b"\xc3"}[value]
    if isinstance(value, int):
        sign, head = next((each for each in _INTEGERS if _fits(value, each[0])), _INTEGERS[-1])
        return struct.pack(f">B{sign}", head, value)
    if isinstance(value, float):
        return struct.pack(">Bd", 0xCB, value)
    if isinstance(value, str):
        data = value.encode()
        return struct.pack(">BI", 0xDB, len(data)) + data
    if isinstance(value, bytes):
        return struct.pack(">BI", 0xC6, len(value)) + value
    if isinstance(value, Mapping):
        entries = (pack(key) + pack(each) for key, each in value.items())
        return struct.pack(">BI", 0xDF, len(value)) + b"".join(entries)
    if isinstance(value, (list, tuple)):
        return struct.pack(">BI", 0xDD, len(value)) + b"".join(map(pack, value))
    raise TypeError(f"a value of type {type(value).__name__}")


def unpack(data: bytes) -> Any:
    """Return MessagePack of the server as a value; arrays may be written to."""
    return _Reader(data).value()


class _Reader:
    """Reader of MessagePack."""

    def __init__(self, data: bytes) -> None:
        self._data = memoryview(data)
        self._at = 0

    def value(self) -> Any:
        head = self._number("B")
        if head < 0x80 or head >= 0xE0:
            return head if head < 0x80 else head - 0x100
        if head < 0xA0:
            return self._map(head & 15) if head < 0x90 else self._list(head & 15)
        if head < 0xC0:
            return str(self._bytes(head & 31), "utf-8")
        if head in (0xC0, 0xC2, 0xC3):
            return {0xC0: None, 0xC2: False, 0xC3: True}[head]
        if head in _NUMBERS:
            return self._number(_NUMBERS[head])
        if head in _SIZES:
            content = self._bytes(self._number(_SIZES[head]))
            return str(content, "utf-8") if head >= 0xD9 else bytes(content)
        count = self._number(_COUNTS[head])
        return self._map(count) if head >= 0xDE else self._list(count)

    def _number(self, sign: str) -> Any:
        (found,) = struct.unpack_from(f">{sign}", self._data, self._at)
        self._at += struct.calcsize(sign)
        return found

    def _bytes(self, size: int) -> memoryview:
        self._at += size
        return self._data[self._at - size : self._at]

    def _list(self, count: int) -> list[Any]:
        return [self.value() for _ in range(count)]

    def _map(self, count: int) -> Any:
        found = {self.value(): self.value() for _ in range(count)}
        if b"__ndarray__" in found:
            return np.frombuffer(found[b"data"], found[b"dtype"]).reshape(found[b"shape"]).copy()
        if b"__npgeneric__" in found:
            return np.dtype(found[b"dtype"]).type(found[b"data"])
        return found


def _fits(value: int, sign: str) -> bool:
    bits = 8 * struct.calcsize(sign)
    return 0 <= value < 1 << bits if sign.isupper() else -(1 << bits - 1) <= value < 1 << bits - 1


def _connected(address: str, timeout: float) -> Any:
    """Return a connection: without compression, bounds of frames, pings and proxies, where websockets has them."""
    options: dict[str, Any] = {"compression": None, "max_size": None, "open_timeout": timeout, "close_timeout": 1.0}
    known = inspect.signature(connect).parameters  # websockets below 15 sends no pings and knows no proxies
    options |= {name: None for name in ("ping_interval", "proxy") if name in known}
    try:
        return connect(address, **options)
    except (OSError, EOFError, ValueError, WebSocketException) as error:
        raise EnvError("connection", f"{address}: cannot be reached ({error})") from None
