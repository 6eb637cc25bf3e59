"""Modules without POSIX: Cellwright has never run on Windows, but must not fail at its first import there."""

import subprocess
import sys

import pytest

from tests.support.waiting import TIMEOUT

EVERYTHING = """
import importlib, os, pkgutil, select, signal, socket, sys, types

def import_everything():
    import cellwright
    for module in pkgutil.walk_packages(cellwright.__path__, "cellwright."):
        if not any(part in module.name for part in ("bridge", "packages.data", "packages.generate", "__main__")):
            importlib.import_module(module.name)

import_everything()  # with all libraries below, which have their own ways on Windows
for name in [*sys.modules]:
    if name.partition(".")[0] == "cellwright":
        del sys.modules[name]
for name in ("curses", "fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"):
    sys.modules[name] = None
for module, missing in (
    (os, "fork killpg setsid getpgrp getpgid setpgid geteuid mkfifo sched_getaffinity WNOHANG set_blocking statvfs"),
    (signal, "SIGKILL SIGHUP SIGPIPE SIGALRM SIGCHLD SIGSTOP SIGCONT SIGWINCH setitimer pthread_sigmask"),
    (socket, "AF_UNIX SO_REUSEPORT MSG_DONTWAIT MSG_NOSIGNAL"),
    (select, "poll epoll"),
):
    for name in missing.split():
        delattr(module, name)
sys.platform, sys.modules["msvcrt"] = "win32", types.ModuleType("msvcrt")
import_everything()
from cellwright.running.evaluation.execution import memory
assert not memory.MEMORY_IS_LIMITED and not memory.usage_below([1])
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="removes from Linux what Windows does not have")
def test_modules_import_without_posix() -> None:
    """All but those that are for ROS's Python: the bridges, the ROS packages' own, and the generator of interfaces."""
    subprocess.run([sys.executable, "-c", EVERYTHING], timeout=TIMEOUT, check=True)
