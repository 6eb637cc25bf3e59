"""Lets our own modules find, on Linux, what they would find on Windows, as far as that can be done in earnest.

Every process that has this folder on its PYTHONPATH begins with it, and so do the processes that it starts. Our modules
are compiled as if `sys.platform` and `os.name` were those of Windows, and what they import lacks the modules and
functions that are there for POSIX alone; the libraries below them stay as they are here. What Windows would refuse is
refused: to wait with `select` for a pipe or for nothing at all, to write files of names that it does not take, and to
read or write text in whatever encoding the machine has.
"""

import builtins
import importlib.abc
import importlib.machinery
import os
import re
import select
import signal
import socket
import subprocess
import sys
import types
import warnings
from pathlib import Path
from typing import Any

MISSING_MODULES = (
    "curses",
    "fcntl",
    "grp",
    "posix_ipc",
    "pty",
    "pwd",
    "readline",
    "resource",
    "syslog",
    "termios",
    "tty",
)
MISSING = {
    os: (
        "fork", "forkpty", "killpg", "setsid", "getsid", "getpgrp", "getpgid", "setpgid", "getuid", "geteuid", "getgid",
        "getegid", "mkfifo", "mknod", "chown", "fchown", "fchmod", "nice", "uname", "wait", "wait3", "wait4", "waitid",
        "WNOHANG", "set_blocking", "get_blocking", "openpty", "ttyname", "sysconf", "statvfs", "sched_getaffinity",
        "sched_yield", "getloadavg", "environb", "pread", "pwrite", "sync", "O_NONBLOCK", "O_CLOEXEC", "O_NOFOLLOW",
        "O_DIRECTORY", "tcgetpgrp", "posix_spawn",
    ),
    signal: (
        "SIGKILL", "SIGHUP", "SIGPIPE", "SIGALRM", "SIGUSR1", "SIGUSR2", "SIGCHLD", "SIGQUIT", "SIGTSTP", "SIGSTOP",
        "SIGCONT", "SIGWINCH", "alarm", "setitimer", "pthread_kill", "pthread_sigmask", "sigwait", "siginterrupt",
    ),
    socket: ("AF_UNIX", "SO_REUSEPORT", "MSG_DONTWAIT", "MSG_NOSIGNAL", "SOCK_NONBLOCK", "SOCK_CLOEXEC", "send_fds"),
    select: ("poll", "epoll"),
}  # fmt: skip
"""What is taken away, by its module."""

O_BINARY = 1 << 30
RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


class Elsewhere(importlib.machinery.SourceFileLoader):
    """Loads a module of ours as it would be loaded on Windows."""

    def get_code(self, fullname: str) -> types.CodeType:
        """Compiled anew where it asks for the system: nothing of that may come to lie beside the sources."""
        path = self.get_filename(fullname)
        text = self.get_data(path).decode("utf-8")
        if "sys.platform" not in text and "os.name" not in text:
            return super().get_code(fullname)  # type: ignore[return-value]
        text = text.replace("sys.platform", '"win32"').replace("os.name", '"nt"')
        return compile(text, path, "exec", dont_inherit=True)

    def exec_module(self, module: types.ModuleType) -> None:
        """What it imports is what is there."""
        vars(module)["__builtins__"] = {**vars(builtins), "__import__": import_as_there}
        super().exec_module(module)


class Finder(importlib.abc.MetaPathFinder):
    """Finds our own modules."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        """The module's place, and how it is loaded."""
        if name.partition(".")[0] != "cellwright":
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is not None and isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            spec.loader = Elsewhere(name, spec.loader.path)
        return spec


def select_as_there(read: Any, write: Any, other: Any, timeout: float | None = None) -> Any:
    """Takes sockets alone, and at least one."""
    asked = [*read, *write, *other]
    if not asked:
        raise OSError(10022, "an invalid argument was supplied")
    if not all(isinstance(each, socket.socket) or hasattr(each, "getsockname") for each in asked):
        raise OSError(10038, "an operation was attempted on something that is not a socket")
    return select.select(read, write, other, timeout)


def refuse_names(event: str, arguments: tuple[object, ...]) -> None:
    """Files that are written have names that Windows takes."""
    if event == "open" and isinstance(arguments[0], str) and isinstance(arguments[2], int):
        written = arguments[2] & (os.O_WRONLY | os.O_RDWR)
        name = os.path.basename(arguments[0])
        is_odd = re.search(r'[<>:"\\|?*\x00-\x1f]|[. ]$', name) or RESERVED.fullmatch(name)
        if written and is_odd and not arguments[0].startswith("/dev/"):
            raise OSError(22, "the name is not one for a file", arguments[0])


def run_as_there(command: Any, *arguments: Any, **options: Any) -> Any:
    """There is `taskkill`, which ends a process; here only one that this one has started."""
    if command[0] == "taskkill":
        number = int(command[command.index("/PID") + 1])
        children = Path(f"/proc/self/task/{os.getpid()}/children").read_text("ascii").split()
        if str(number) in children:
            os.kill(number, signal.SIGKILL)
        return subprocess.CompletedProcess(command, 0 if str(number) in children else 128)
    return subprocess.run(command, *arguments, **options)


TEXT_FILES: set[int] = set()
"""Descriptors whose line ends are written as two characters."""


def open_as_there(path: Any, flags: int, mode: int = 0o777, **options: Any) -> int:
    """Opens a file for text unless it is told otherwise."""
    descriptor = os.open(path, flags & ~O_BINARY, mode, **options)
    (TEXT_FILES.discard if flags & O_BINARY else TEXT_FILES.add)(descriptor)
    return descriptor


def write_as_there(descriptor: int, data: Any) -> int:
    """Writes all of it, or fails."""
    text = bytes(data)
    os.write(descriptor, text.replace(b"\n", b"\r\n") if descriptor in TEXT_FILES else text)
    return len(text)


def without(module: types.ModuleType, **others: Any) -> types.ModuleType:
    """A module as it is there: without what is missing, and with other things in it."""
    there = types.ModuleType(module.__name__)
    missing = MISSING.get(module, ())
    vars(there).update({name: value for name, value in vars(module).items() if name not in missing}, **others)
    return there


THERE = {
    "os": without(os, O_BINARY=O_BINARY, open=open_as_there, write=write_as_there),
    "select": without(select, select=select_as_there),
    "signal": without(signal),
    "socket": without(socket),
    "subprocess": without(subprocess, run=run_as_there, CREATE_NEW_PROCESS_GROUP=0),
    "msvcrt": without(types.ModuleType("msvcrt"), LK_NBLCK=2, locking=lambda *_: None, kbhit=lambda: False),
}
"""Modules that are another there."""


def import_as_there(name: str, where: Any = None, local: Any = None, wanted: Any = (), level: int = 0) -> Any:
    """What an import statement of ours finds."""
    if level == 0 and name in MISSING_MODULES:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    if level == 0 and name in THERE:
        return THERE[name]
    return builtins.__import__(name, where, local, wanted, level)


sys.addaudithook(refuse_names)
warnings.filterwarnings("error", category=EncodingWarning, module=r"cellwright(\.|$)")
sys.meta_path.insert(0, Finder())
