"""Description of the machine."""

import os
import platform
from pathlib import Path

import pytest

from benchmarks import machine


def test_machine_has_no_host_name_or_home_folder() -> None:
    found = machine.machine()
    assert {"processor", "processors", "system", "versions"} <= found.keys()
    text = " ".join(found.values())
    assert "mujoco 4." in found["versions"]
    assert str(Path.home()) not in text
    assert platform.node() not in text.split()


def test_machine_with_little_information_omits_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_arguments: object, **_more: object) -> str:
        raise OSError

    monkeypatch.setattr(machine, "CPU_INFO", Path("nowhere"))
    monkeypatch.setattr(platform, "freedesktop_os_release", refuse)
    for name in ("sysconf", "getloadavg"):
        monkeypatch.delattr(os, name, raising=False)
    found = machine.machine()
    assert {"memory", "load before"}.isdisjoint(found)
    assert found["processor"] == (platform.processor() or platform.machine())
    assert found["system"] == f"{platform.system()} {platform.release()}"
