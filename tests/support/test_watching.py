"""Tests of watching: an agent gets the same messages at the same times, and leaves the same state."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from cellwright import load_trial
from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import Agent, find_agent
from cellwright.clients.client.in_process import InProcess
from cellwright.running.run import RunOptions, run_cell
from tests.clients.client.test_socket_transport import connected, served
from tests.support.watching import ACTIONS, TRIAL, WATCHERS, Action, Watcher, all_topics, recording, unwatched, work

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)

LATE: list[Action] = [
    ("wait", 110),
    ("subscribe", "/ariac/break_beam_1"),
    ("subscribe", "/ariac/break_beam_1_change"),
    ("move", 0),
    ("wait", 20),
    ("subscribe", "/ariac/logical_camera_2"),
    ("subscribe", "/ariac/laser_profiler_1"),
    ("subscribe", "/tf"),
    ("subscribe", "/ariac/quality_control_sensor_1"),
    ("subscribe", "/ariac/arm/follow_joint_trajectory/status"),
    ("move", 1),
    ("wait", 70),
    ("unsubscribe", 2),
    ("subscribe", "/ariac/logical_camera_2"),
    ("move", 2),
]
"""Subscriptions to latched topics in mid-run, some of them repeated."""


@pytest.mark.slow
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(actions=ACTIONS, watch=st.sampled_from(WATCHERS))
@example(actions=LATE, watch=WATCHERS[0])
@example(actions=LATE, watch=WATCHERS[1])
@example(actions=LATE, watch=WATCHERS[2])
def test_observed_random_agent_has_same_state(tmp_path: Path, actions: list[Action], watch: Watcher) -> None:
    found = []
    for look in (unwatched, watch):
        cell = Cell(TRIAL)
        look(cell, tmp_path)
        found.append((work(InProcess(cell), actions), cell.state_hash()))
    alone, watched = found
    assert watched == alone


def test_late_subscriber_of_latched_topic_gets_newest_message() -> None:
    heard = work(InProcess(Cell(TRIAL)), LATE)
    first: dict[str, int] = {}
    for time, topic, _ in heard:
        first.setdefault(topic, time)
    begun, later = 222_000_000, 262_000_000  # the step after subscribing: in one process messages come with a step
    assert first["/ariac/break_beam_1"] == begun
    assert {first[topic] for topic in ("/ariac/logical_camera_2", "/ariac/quality_control_sensor_1")} == {later}
    assert first["/ariac/arm/follow_joint_trajectory/status"] == later
    assert first["/ariac/laser_profiler_1"] == 270_000_000  # not latched: the next one


def agent_of(source: str, folder: Path) -> Agent:
    """Return a new agent: a known one, or `PAGE CLASS` in a page's example."""
    page, _, name = source.partition(" ")
    if not name:
        return find_agent(source)()
    (block,) = [each for each in BLOCK.findall((ROOT / page).read_text()) if f"class {name}:" in each]
    (folder / "example.py").write_text(block)
    found: Agent = runpy.run_path(str(folder / "example.py"))[name]()
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    "source",
    [
        "lesson",
        "kitter",
        "README.md MyRobot",
        "docs/agents.md BeltPicker",
        "docs/getting-started.md MyRobot",
        "docs/motion.md Mover",
        "docs/serve.md Looks",
        "docs/how-to/add-an-agent.md Taster",
        "docs/how-to/find-a-part.md Finder",
    ],
)
def test_observed_agents_of_docs_have_same_state(tmp_path: Path, source: str) -> None:
    trial = load_trial("lesson")
    found = []
    for watch in (unwatched, all_topics, recording):
        cell = Cell(trial)
        watch(cell, tmp_path)
        result = run_cell(cell, agent_of(source, tmp_path), RunOptions(until=8.0))
        found.append((result.state_hash, cell.simulation.now, result.outcome, result.error))
    assert found[1:] == found[:1] * 2


@pytest.mark.slow
@pytest.mark.parametrize("watch", [unwatched, *WATCHERS])
def test_observed_agent_over_socket_has_same_state(tmp_path: Path, watch: Watcher) -> None:
    cell = Cell(TRIAL)
    expected = work(InProcess(cell), LATE)
    other = Cell(TRIAL)
    watch(other, tmp_path)
    with served(other) as home, connected(home) as transport:
        assert work(transport, LATE) == expected
        assert home.end().state_hash == cell.state_hash()
