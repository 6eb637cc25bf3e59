"""Interactive terminal: bash on a pseudo-terminal."""

import codecs
import os
import pty
import re
import select
import signal
import subprocess
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from tests.support.waiting import TIMEOUT, wait_until

_PROMPT = re.compile(r"«(\d+)»$")
_ESCAPES = re.compile(r"\x1b\][^\x07]*\x07|\x1b\[[0-9;?]*[A-Za-z]")
# Without echo, only the output of commands is read; the prompt holds the exit status of the last one.
_PREPARE = r"stty -echo -onlcr cols 200; unset PROMPT_COMMAND; PS2=; PS1='«$?»'; bind 'set enable-bracketed-paste off'"


def plain(text: str) -> str:
    """Text without colours, titles of windows and carriage returns."""
    return _ESCAPES.sub("", text).replace("\r", "")


class Terminal:
    """Bash with job control: the programs that it starts get Ctrl-C as from a keyboard.

    Args:
        folder: its first working folder.
        environment: its environment, whole.
    """

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self._leader, follower = pty.openpty()
        self._process = subprocess.Popen(
            # A session of its own that the pseudo-terminal controls; otherwise Ctrl-C would be an ordinary character.
            ["setsid", "--ctty", "bash", "--norc", "--noprofile", "-i"],
            cwd=folder,
            env={**environment, "TERM": "dumb"},
            stdin=follower,
            stdout=follower,
            stderr=follower,
        )
        os.close(follower)
        self._decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")
        self._printed = ""
        self._type(_PREPARE)
        self.wait(lambda: "«0»" in self._printed, "prompt")

    @property
    def printed(self) -> str:
        """Output of the last command so far, without colours."""
        return _PROMPT.sub("", plain(self._printed))

    @property
    def status(self) -> int | None:
        """Exit status of the last command; None while it runs."""
        found = _PROMPT.search(self._printed)
        return int(found[1]) if found else None

    @property
    def foreground(self) -> str:
        """Name of the program that gets Ctrl-C; the shell itself if none runs."""
        return Path(f"/proc/{os.tcgetpgrp(self._leader)}/comm").read_text(encoding="utf-8").strip()

    def give(self, command: str) -> None:
        """Type a command."""
        self._printed = ""
        self._type(command)

    def interrupt(self) -> None:
        """Press Ctrl-C."""
        self._printed = ""
        os.write(self._leader, b"\x03")

    def wait(self, condition: Callable[[], object], name: str, timeout: float = TIMEOUT) -> None:
        """Read until a condition holds.

        Args:
            condition: checked after each output.
            name: noun of the expected event, for the error.
            timeout: bound [s].

        Raises:
            AssertionError: the condition never held; the text has what was printed.
        """
        wait_until(condition, name, seen=lambda: self.printed, between=self._read, timeout=timeout)

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the window: the command that still runs in it is interrupted."""
        for _ in range(5):  # a command that has only just been typed may miss the first
            if self.status is None:
                self.interrupt()
                with suppress(AssertionError):
                    self.wait(lambda: self.status is not None, "end of the command", timeout=5.0)
        os.close(self._leader)
        try:
            self._process.wait(TIMEOUT)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()

    def _type(self, line: str) -> None:
        os.write(self._leader, line.encode() + b"\n")

    def _read(self) -> None:
        """Read the available output, or the next within a second."""
        if not select.select([self._leader], [], [], 1.0)[0]:
            return
        try:
            data = os.read(self._leader, 65536)
        except OSError:
            raise AssertionError(f"the shell has ended:\n{self.printed}") from None
        self._printed += self._decoder.decode(data)
