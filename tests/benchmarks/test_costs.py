"""Marginal costs, with few steps."""

import pytest

from benchmarks import costs
from cellwright.engine.snapshot import take_snapshot


@pytest.mark.slow
def test_costs_quick_run_yields_figures_with_notes() -> None:
    progress: list[str] = []
    figures = {figure.label: figure for figure in costs.measure(progress.append, quick=True)}
    assert [line.split()[0] for line in progress] == ["listeners", "a", "a", "a"]
    assert all(figure.value > 0.0 for figure in figures.values())
    assert "20 messages in 20 steps" in figures["a subscriber to /clock / none"].note
    assert "a subscriber to /ariac/orders / none" not in figures
    assert figures["a run of the agent recorded / without"].value > 0
    assert figures["a run of the agent recorded / with subscribers"].value > 0
    assert "KiB written" in figures["a run of the agent with a log / without"].note


def test_listeners_leave_state_hash_unchanged() -> None:
    cell = costs.lesson_cell()
    start = take_snapshot(cell.simulation)
    costs._run(cell, start, 30)
    alone = cell.state_hash()
    received: list[str] = []
    costs._run(cell, start, 30, cell.topics(), received)
    assert received.count("/clock") == 30
    assert cell.state_hash() == alone
    assert not any(topic.subscribers for topic in cell.bus.topics() if topic.publishers)


def test_silent_topics_are_not_timed() -> None:
    cell = costs.lesson_cell()
    start = take_snapshot(cell.simulation)
    names = costs._active_topics(cell, start, 200)
    assert {"/clock", "/ariac/joint_states", "/ariac/laser_profiler"} <= set(names)
    assert {"/tf_static", "/ariac/orders"}.isdisjoint(names)


def test_lesson_cell_starts_without_listeners() -> None:
    cell = costs.lesson_cell()
    cell.step()
    assert cell.competition.state in ("ready", "go")
    assert not any(topic.subscribers for topic in cell.bus.topics() if topic.publishers)
