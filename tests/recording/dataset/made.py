"""Recordings of programs that steer as environments do, for tests of data sets."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np

from cellwright import Client, RunOptions, Session
from tests.envs.test_stepper import send

TASK, SEED, RATE = "pick_from_bin", 1, 20


class Steers:
    """Sends an action each control period, from the first tick on, as messages."""

    def __init__(self, session: Session, actions: Sequence[Sequence[float]]) -> None:
        self._session, self._actions = session, actions

    def run(self, client: Client) -> None:
        """Send them, and wait for the end."""
        cell, before = self._session.node, [0.0] * 8
        for action in self._actions:
            send(client, cell, client.control_space(), action, before)
            client.sleep(1 / RATE)
            before = list(action)
        client.sleep(100.0)


def kitted(path: Path, seed: int = SEED, *, varied: bool = False, until: float | None = None) -> Path:
    """Record a run of the task by kitter."""
    with (
        Session(TASK, seed=seed, record=path, options=RunOptions(until=until)) as session,
        closing(session.node.simulation),  # kitter looks at pictures, which a process draws
    ):
        if varied:
            session.reset(seed=seed, variation=True)
        session.run("kitter")
    return path


def actions_around(first: Any, count: int) -> list[Any]:
    """Return actions about the first observation, float32, with suction that changes."""
    generator = np.random.default_rng(3)
    found = []
    for number in range(count):
        action = first + generator.uniform(-0.05, 0.05, first.shape).astype(np.float32)
        action[-1] = float(number % 4 > 1)
        found.append(action)
    return found


def steered(path: Path, actions: Sequence[Any], until: float) -> Path:
    """Record a run of the task with these actions."""
    with Session(TASK, seed=SEED, record=path, options=RunOptions(until=until)) as session:
        session.run(Steers(session, [[float(each) for each in action] for action in actions]))
    return path
