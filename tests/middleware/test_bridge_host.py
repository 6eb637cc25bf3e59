"""Bridges to ROS: their start, the reasons of those that fail, and their supervision."""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cellwright.middleware.bridge_host import REGISTER_AGAIN, BridgeHost, BridgeProcess, start_bridge
from cellwright.util.errors import UsageError
from tests.support.waiting import wait_until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="ROS 1 is not there")


class Started:
    """Stand-in for a bridge that lives and becomes ready after some calls."""

    def __init__(self, ready_after: float) -> None:
        self.is_ready = False
        self.last_line, self.last_printed = "no license", ""
        self._left = ready_after

    def poll(self) -> None:
        self._left -= 1
        self.is_ready = self._left <= 0


def wait_with_clock(monkeypatch: pytest.MonkeyPatch, ready_after: float, said: list[str]) -> bool:
    """Start a bridge that takes `ready_after` seconds on the wall clock, which each call moves by one."""
    now = iter(range(1_000_000))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(now)))
    bridge: Any = Started(ready_after)
    return start_bridge(bridge, "ROS 2", lambda _seconds: None, lambda: False, said.append)


def test_bridge_that_lives_may_start_slowly_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    assert wait_with_clock(monkeypatch, 65, said)
    assert said == [
        f"the ROS 2 bridge is not ready after {seconds} s; waiting for up to 300 s" for seconds in (20, 40, 60)
    ]


def test_bridge_that_lives_without_being_ready_is_given_up_after_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match="the ROS 2 bridge is not ready after 300 s: no license"):
        wait_with_clock(monkeypatch, math.inf, [])


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("import sys; print('ports'); print('domain', file=sys.stderr); sys.exit(1)", ": domain"),
        ("import sys; print('\\033[31;1mno ports\\033[m'); sys.exit(1)", ": no ports"),
        (
            "import sys; sys.exit(1)",
            (
                ": it gave no reason; see the variables that `printenv | grep ROS` prints, "
                "and the newest log of ~/.ros/log"
            ),
        ),
    ],
    ids=["on stderr", "on stdout", "nowhere"],
)
def test_bridge_that_ends_early_gives_its_reason_or_where_to_look(tmp_path: Path, program: str, said: str) -> None:
    (tmp_path / "bridge.py").write_text(program)
    bridge = BridgeProcess(
        tmp_path / "bridge.py",
        ("127.0.0.1", 1),
        (),
        python=sys.executable,
        environment=os.environ,
        on_line=lambda _line: None,
    )
    with pytest.raises(UsageError) as failed:
        start_bridge(bridge, "ROS 2", lambda _seconds: None, lambda: False, lambda _line: None)
    bridge.stop()
    assert str(failed.value) == f"the ROS 2 bridge ended with status 1{said}"


class Host(BridgeHost):
    """Host of bridges that are Python programs, one after the other."""

    kind = "ROS 7"

    def __init__(self, report: Callable[[str], None], folder: Path, *programs: str) -> None:
        super().__init__(report, lambda: False)
        self._program, self._waiting = folder / "bridge.py", list(programs)
        self.starts = 0

    def _start(self) -> BridgeProcess:
        self.starts += 1
        self._program.write_text(self._waiting.pop(0))
        self._bridge = BridgeProcess(
            self._program, ("127.0.0.1", 1), (), python=sys.executable, environment=os.environ, on_line=self._on_line
        )
        return self._bridge


def is_back(host: Host, said: list[str]) -> bool:
    host.poll()
    return "all topics and services are in ROS 7 again" in said


READY = "import sys; print('ready', flush=True); sys.stdin = None; import time; time.sleep(600)"


@pytest.mark.parametrize(
    ("status", "reports"), [(3, ["the ROS 7 bridge ended with status 3; restarting it"]), (REGISTER_AGAIN, [])]
)
def test_bridge_that_ends_is_started_again(status: int, reports: list[str], tmp_path: Path) -> None:
    said: list[str] = []
    with Host(said.append, tmp_path, f"import sys; print('late', file=sys.stderr); sys.exit({status})", READY) as host:
        host.poll()
        wait_until(lambda: is_back(host, said), "ready again")
        assert (host.starts, said) == (2, ["ROS 7: late", *reports, "all topics and services are in ROS 7 again"])
    assert host.bridge_pid is None


def test_bridge_that_cannot_be_started_is_reported_and_tried_later(tmp_path: Path) -> None:
    said: list[str] = []
    with Host(said.append, tmp_path / "missing", READY) as host:
        host.poll()
    assert len(said) == 1
    assert said[0].startswith("a ROS 7 program could not be started: ")
    assert said[0].endswith("; trying again")
