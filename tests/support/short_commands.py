"""Command `cellwright` for shells of tests, without the start of an interpreter for short commands.

A page gives dozens of short commands, and the start of each costs a second of processor time. Here a script passes them
to the process of the tests, which runs each in a fork of a warm process. All other commands start an interpreter, as
they do for users: Ctrl-C reaches those alone.
"""

from __future__ import annotations

import json
import os
import shlex
import socketserver
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.support.waiting import TIMEOUT
from tests.support.warm import WarmStart

SMALL_PICTURES = Path(__file__).with_name("small_pictures.py")

_ASK = """\
import json, os, socket, sys
with socket.create_connection(("127.0.0.1", int(sys.argv[1]))) as line:
    asked = {"arguments": sys.argv[2:], "folder": os.getcwd(), "environment": dict(os.environ)}
    line.sendall(json.dumps(asked).encode() + b"\\n")
    answer = line.makefile("rb").read()
if not answer:
    sys.exit("the command has failed in the process of the tests")
out, err, status = json.loads(answer)
for stream, text in ((sys.stdout, out), (sys.stderr, err)):
    stream.reconfigure(encoding="utf-8")
    stream.write(text)
    stream.flush()
sys.exit(status)
"""


class _Server(socketserver.TCPServer):
    """Server that runs commands, one after the other: a warm process takes no second one meanwhile."""

    def __init__(self, warm: WarmStart, program: str) -> None:
        super().__init__(("127.0.0.1", 0), _Answer)
        self._warm, self._program = warm, program

    def run(self, arguments: list[str], folder: Path, environment: dict[str, str]) -> list[Any]:
        """Run a command; return its output on both streams, and its exit status."""
        ran = self._warm.run(self._program, *arguments, folder=folder, environment=environment)
        return [ran.stdout, ran.stderr, ran.returncode]


class _Answer(socketserver.StreamRequestHandler):
    server: _Server

    def handle(self) -> None:
        asked = json.loads(self.rfile.readline())
        answer = self.server.run(asked["arguments"], Path(asked["folder"]), asked["environment"])
        self.wfile.write(json.dumps(answer).encode())


@contextmanager
def short_commands(
    script: Path, short: tuple[str, ...], warm: WarmStart, program: Path = SMALL_PICTURES
) -> Iterator[None]:
    """Provide a command `cellwright` within a block.

    Args:
        script: the file to write.
        short: patterns of shells for the arguments of commands with an end of their own, such as `check *`.
        warm: runs those.
        program: in Python; the command.
    """
    modules = f"PYTHONPATH={shlex.quote(os.environ['PYTHONPATH'])} " if "PYTHONPATH" in os.environ else ""
    patterns = "|".join(pattern.replace(" ", r"\ ") for pattern in short)
    with _Server(warm, program.read_text(encoding="utf-8")) as server:
        ask = shlex.join([sys.executable, "-I", "-S", "-c", _ASK, str(server.server_address[1])])
        start = shlex.join([sys.executable, "-P", str(program)])
        script.write_text(
            f'#!/bin/sh\ncase "$*" in {patterns}) exec {ask} "$@";; esac\n{modules}exec {start} "$@"\n',
            encoding="utf-8",
        )
        script.chmod(0o755)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield
        finally:
            server.shutdown()
            thread.join(TIMEOUT)
