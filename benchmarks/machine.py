"""Context of a figure besides Cellwright: machine, system and versions. Nothing identifies the machine itself."""

from __future__ import annotations

import os
import platform
import subprocess
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from cellwright.running.evaluation.execution.process import usable_processors
from cellwright.running.run.result import versions

GIBIBYTE = 1024**3
CPU_INFO = Path("/proc/cpuinfo")
"""Linux's description of the processors."""

PEERS = ("pybullet", "rosbags")
"""Other packages that affect figures, where they are installed."""


def machine() -> dict[str, str]:
    """Return the context of the figures as pairs of words; unknown ones are left out."""
    found = {
        "processor": processor(),
        "processors": str(usable_processors()),
        "memory": memory(),
        "system": system(),
        "load before": busy(),
    }
    known = {name: value for name, value in versions().items() if name != "platform"}
    for name in PEERS:
        with suppress(PackageNotFoundError):
            known[name] = version(name)
    found["versions"] = ", ".join(f"{name} {value}" for name, value in known.items())
    return {name: value for name, value in found.items() if value}


def processor() -> str:
    """Return the model of the processor, or its architecture if that is all that is known."""
    with suppress(OSError):
        for line in CPU_INFO.read_text(encoding="utf-8").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                return value.strip()
    if platform.system() == "Darwin":
        with suppress(OSError, subprocess.SubprocessError):
            command = ["/usr/sbin/sysctl", "-n", "machdep.cpu.brand_string"]
            return subprocess.run(command, capture_output=True, text=True, check=True, timeout=5.0).stdout.strip()  # noqa: S603
    return platform.processor() or platform.machine()


def memory() -> str:
    """Return the memory of the machine; empty where it is unknown."""
    try:
        amount = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # there is no sysconf on Windows
        return ""
    return f"{amount / GIBIBYTE:.1f} GiB"


def system() -> str:
    """Return the operating system and its version."""
    with suppress(OSError):
        return str(platform.freedesktop_os_release()["PRETTY_NAME"])
    return f"{platform.system()} {platform.release()}"


def busy() -> str:
    """Return the number of busy processors in the minute before: it should be near 0. Empty where it is unknown."""
    try:
        return f"{os.getloadavg()[0]:.1f} processors"
    except (AttributeError, OSError):  # there is none on Windows
        return ""
