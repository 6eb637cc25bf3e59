"""A Ray cluster of two nodes on this machine, and an environment in which Ray leaves no traces outside of the tests."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support.processes import FAMILY, kill, members

ROOT = Path(__file__).parents[5]
NODES = 2


def ray_environment() -> dict[str, str]:
    """Return the variables of Ray: no figures for its makers, no token in the home folder, no files elsewhere.

    With the last, a driver knows after 5 s that its cluster is gone.
    """
    return {
        "RAY_USAGE_STATS_ENABLED": "0",
        "RAY_AUTH_MODE": "disabled",
        "RAY_TMPDIR": tempfile.gettempdir(),
        "RAY_gcs_rpc_server_reconnect_timeout_s": "5",
    }


@dataclass(frozen=True)
class Cluster:
    """A cluster; the first node is its head."""

    address: str
    raylets: tuple[int, ...]
    family: str

    def end(self) -> None:
        """Kill all of its processes, as when its machines lose power."""
        kill(members(self.family))


@pytest.fixture(scope="module")
def cluster() -> Iterator[Cluster]:
    family = uuid.uuid4().hex
    environment: Mapping[str, str] = {**os.environ, **ray_environment(), FAMILY: family}
    command = [sys.executable, "-m", "tests.running.evaluation.execution.on_ray.cluster", str(NODES)]
    with (
        tempfile.TemporaryFile() as errors,
        subprocess.Popen(
            command, cwd=ROOT, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors
        ) as process,
    ):
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            line = process.stdout.readline()
            errors.seek(0)
            assert line, errors.read().decode(errors="replace")
            found = json.loads(line)
            yield Cluster(found["address"], tuple(found["raylets"]), family)
        finally:
            process.stdin.close()
            process.wait()
            kill(members(family))  # workers of a node that a test has killed


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give Ray's variables to the processes of a test."""
    for name, value in ray_environment().items():
        monkeypatch.setenv(name, value)
