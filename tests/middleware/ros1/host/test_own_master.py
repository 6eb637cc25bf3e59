"""Supervision of an own master."""

from __future__ import annotations

import os
import shutil
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from cellwright.middleware import child
from cellwright.middleware.ros1.host import installation
from cellwright.middleware.ros1.host.installation import Installation
from cellwright.middleware.ros1.host.master import MasterClient, OwnMaster
from cellwright.util.errors import UsageError
from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]


def never() -> bool:
    return False


@pytest.fixture
def place(no_master: Ground) -> Installation:
    """This machine's ROS 1, with the address of a free port."""
    return installation.find(no_master.environment)


@pytest.fixture
def own(place: Installation, no_master: Ground) -> Iterator[tuple[OwnMaster, MasterClient, list[str]]]:
    said: list[str] = []
    master = MasterClient(no_master.uri)
    made = OwnMaster(place, master, said.append)
    yield made, master, said
    made.stop()
    assert not master.answers()


Own = tuple[OwnMaster, MasterClient, list[str]]


@pytest.mark.ros1
def test_own_master_answers_and_has_run_id(own: Own, no_master: Ground) -> None:
    made, master, said = own
    made.wait(never)
    made.mark()
    first = no_master.ask("getParam", "/run_id")
    made.mark()
    assert no_master.ask("getParam", "/run_id") != first
    assert master.answers()
    assert not said


@pytest.mark.ros1
def test_wait_returns_at_once_when_stopped(own: Own) -> None:
    made, master, _ = own
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(master, "answers", lambda: False)  # it never answers: waiting would end with an error
        made.wait(lambda: True)


@pytest.mark.ros1
def test_own_master_killed_and_replaced_is_not_restarted(own: Own, no_master: Ground) -> None:
    made, master, said = own
    made.wait(never)
    os.kill(no_master.ask("getPid"), signal.SIGKILL)
    wait_until(lambda: not master.is_port_taken(), "end of the master")
    no_master.start_master()

    def has_said_both() -> bool:
        made.poll()
        return len(said) == 2

    wait_until(has_said_both, "two reports")
    assert "was ended by SIGKILL; restarting it" in said[0]
    assert "another program listens" in said[1]
    made.poll()
    made.stop()
    assert master.answers()
    no_master.stop_master()


def script(path: Path, text: str) -> Installation:
    """Return an installation with a shell script as rosmaster."""
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return Installation(shutil.which("python3") or "", {"PATH": f"{path.parent}:{os.environ['PATH']}"}, ())


def test_own_master_that_ends_at_once_is_reported_with_output(tmp_path: Path) -> None:
    broken = script(tmp_path / "rosmaster", "echo it is broken >&2; exit 3")
    made = OwnMaster(broken, MasterClient("http://127.0.0.1:9", 0.2), lambda _line: None)
    with pytest.raises(UsageError, match=r"at http://127\.0\.0\.1:9 ended with status 3: it is broken$"):
        made.wait(never)
    made.stop()


def test_own_master_that_never_answers_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child, "READY_LIMIT", 0.5)
    silent = script(tmp_path / "rosmaster", "exec sleep 60")  # it shall just live on
    made = OwnMaster(silent, MasterClient("http://127.0.0.1:9", 0.2), lambda _line: None)
    with pytest.raises(UsageError, match="does not answer"):
        made.wait(never)
    made.stop()


def test_own_master_without_rosmaster_is_refused_with_instructions(tmp_path: Path) -> None:
    nothing = Installation("/usr/bin/python3", {"PATH": str(tmp_path)}, ())
    with pytest.raises(UsageError, match="rosmaster is not installed; on Debian 12 and Ubuntu: scripts/install-ros1"):
        OwnMaster(nothing, MasterClient("http://127.0.0.1:9"), lambda _line: None)
