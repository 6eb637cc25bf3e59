"""Imitation of Windows on Linux for Cellwright's own modules.

Every process with this folder on its PYTHONPATH starts with it, and so do its child processes. Cellwright's modules are
compiled as if `sys.platform` and `os.name` were those of Windows. Their imports lack the modules and functions that
exist on POSIX only; the libraries below them are unchanged.

Operations that Windows refuses fail: `select` on a pipe or on nothing, writing files with names that Windows does not
allow, and reading or writing text in the machine's default encoding.
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
"""Names that are removed, by module."""

O_BINARY = 1 << 30
RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


class WindowsLoader(importlib.machinery.SourceFileLoader):
    """Loader of Cellwright's modules as on Windows."""

    def get_code(self, fullname: str) -> types.CodeType:
        """Compile a module that reads the system's name without a cache file beside the sources."""
        path = self.get_filename(fullname)
        text = self.get_data(path).decode("utf-8")
        if "sys.platform" not in text and "os.name" not in text:
            return super().get_code(fullname)  # type: ignore[return-value]
        text = text.replace("sys.platform", '"win32"').replace("os.name", '"nt"')
        return compile(text, path, "exec", dont_inherit=True)

    def exec_module(self, module: types.ModuleType) -> None:
        """Execute a module with the imports that Windows has."""
        vars(module)["__builtins__"] = {**vars(builtins), "__import__": import_as_on_windows}
        super().exec_module(module)


class Finder(importlib.abc.MetaPathFinder):
    """Finder of Cellwright's own modules."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        """Return the spec of a module, with the loader above."""
        if name.partition(".")[0] != "cellwright":
            return None
        spec = importlib.machinery.PathFinder.find_spec(name, path, target)
        if spec is not None and isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            spec.loader = WindowsLoader(name, spec.loader.path)
        return spec


def select_as_on_windows(read: Any, write: Any, other: Any, timeout: float | None = None) -> Any:
    """Accept sockets only, and at least one."""
    sockets = [*read, *write, *other]
    if not sockets:
        raise OSError(10022, "an invalid argument was supplied")
    if not all(isinstance(each, socket.socket) or hasattr(each, "getsockname") for each in sockets):
        raise OSError(10038, "an operation was attempted on something that is not a socket")
    return select.select(read, write, other, timeout)


def refuse_names(event: str, arguments: tuple[object, ...]) -> None:
    """Refuse to write files with names that Windows does not allow."""
    if event == "open" and isinstance(arguments[0], str) and isinstance(arguments[2], int):
        written = arguments[2] & (os.O_WRONLY | os.O_RDWR)
        name = os.path.basename(arguments[0])
        is_odd = re.search(r'[<>:"\\|?*\x00-\x1f]|[. ]$', name) or RESERVED.fullmatch(name)
        if written and is_odd and not arguments[0].startswith("/dev/"):
            raise OSError(22, "the name is not one for a file", arguments[0])


def run_as_on_windows(command: Any, *arguments: Any, **options: Any) -> Any:
    """Imitate `taskkill` for child processes of this process."""
    if command[0] == "taskkill":
        number = int(command[command.index("/PID") + 1])
        children = Path(f"/proc/self/task/{os.getpid()}/children").read_text("ascii").split()
        if str(number) in children:
            os.kill(number, signal.SIGKILL)
        return subprocess.CompletedProcess(command, 0 if str(number) in children else 128)
    return subprocess.run(command, *arguments, **options)


TEXT_FILES: set[int] = set()
"""Descriptors whose line ends are written as two characters."""


def open_as_on_windows(path: Any, flags: int, mode: int = 0o777, **options: Any) -> int:
    """Open a file, as text unless O_BINARY is set."""
    descriptor = os.open(path, flags & ~O_BINARY, mode, **options)
    (TEXT_FILES.discard if flags & O_BINARY else TEXT_FILES.add)(descriptor)
    return descriptor


def write_as_on_windows(descriptor: int, data: Any) -> int:
    """Write all data, or fail."""
    text = bytes(data)
    os.write(descriptor, text.replace(b"\n", b"\r\n") if descriptor in TEXT_FILES else text)
    return len(text)


def without(module: types.ModuleType, **others: Any) -> types.ModuleType:
    """Return a copy of a module without its POSIX parts, and with `others` in it."""
    copy = types.ModuleType(module.__name__)
    missing = MISSING.get(module, ())
    vars(copy).update({name: value for name, value in vars(module).items() if name not in missing}, **others)
    return copy


REPLACEMENTS = {
    "os": without(os, O_BINARY=O_BINARY, open=open_as_on_windows, write=write_as_on_windows),
    "select": without(select, select=select_as_on_windows),
    "signal": without(signal),
    "socket": without(socket),
    "subprocess": without(subprocess, run=run_as_on_windows, CREATE_NEW_PROCESS_GROUP=0),
    "msvcrt": without(types.ModuleType("msvcrt"), LK_NBLCK=2, locking=lambda *_: None, kbhit=lambda: False),
}
"""Modules that are different on Windows."""


def import_as_on_windows(name: str, where: Any = None, local: Any = None, names: Any = (), level: int = 0) -> Any:
    """Import a module as on Windows."""
    if level == 0 and name in MISSING_MODULES:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    if level == 0 and name in REPLACEMENTS:
        return REPLACEMENTS[name]
    return builtins.__import__(name, where, local, names, level)


sys.addaudithook(refuse_names)
warnings.filterwarnings("error", category=EncodingWarning, module=r"cellwright(\.|$)")
sys.meta_path.insert(0, Finder())
