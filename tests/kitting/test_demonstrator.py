"""Styles and mistakes of the demonstrations."""

from collections.abc import Iterable, Sequence
from typing import cast

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.postures import Knots, Postures
from cellwright.clients.client import Client
from cellwright.running.run import RunOptions, RunResult, run_cell
from cellwright.util.errors import UsageError
from kitting.benchmark import Split, find_tasks, seeds
from kitting.demonstrator import MISTAKES, SLIP, SLOWEST, Demonstrator, PacedPostures, Style


def run(task: str, style: Style, monkeypatch: pytest.MonkeyPatch) -> RunResult:
    """Return the result of a demonstration in a style."""
    monkeypatch.setattr(Style, "draw", lambda _seed: style)
    return run_cell(Cell(find_tasks([task])[0].trial(Split.TRAIN)), Demonstrator(), RunOptions())


def test_style_follows_from_the_seed_alone() -> None:
    assert Style.draw(5) == Style.draw(5)
    assert len({Style.draw(seed) for seed in seeds(Split.TRAIN)}) == 200


def test_styles_are_spread_over_their_ranges_with_both_mistakes() -> None:
    styles = [Style.draw(seed) for seed in seeds(Split.TRAIN)]
    paces = [style.pace for style in styles]
    assert 1.0 <= min(paces) < 1.05
    assert SLOWEST - 0.05 < max(paces) <= SLOWEST
    assert {style.grip for style in styles} == {0, 1, 2, 3, 4}
    for made in ([style.misses for style in styles], [any(style.slip) for style in styles]):
        assert abs(sum(map(bool, made)) / len(styles) - MISTAKES) < 0.1
    assert not any(style.misses and any(style.slip) for style in styles)


class OneMotion:
    """Postures with one motion of 2 s."""

    height = 0.7

    def motion(self, start: Sequence[float], stops: Iterable[Sequence[float]]) -> Knots:
        return Knots([0.0, 2.0], [start, *stops], [[0.0], [1.0]])


def test_paced_motion_takes_longer_along_the_same_way() -> None:
    paced = PacedPostures(cast("Postures", OneMotion()), 1.5)
    assert paced.motion([0.0], [[2.0]]) == Knots([0.0, 3.0], [[0.0], [2.0]], [[0.0], [1.0 / 1.5]])
    assert paced.height == 0.7


def test_cell_in_another_process_is_refused() -> None:
    class Far:
        transport = object()

    with pytest.raises(UsageError, match="so it needs the cell in its process; leave out --over"):
        Demonstrator().run(cast("Client", Far()))


@pytest.mark.slow
def test_grasp_in_vain_costs_time_and_the_part_is_picked_up_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    tidy = run("pick_from_bin", Style(), monkeypatch)
    missed = run("pick_from_bin", Style(misses=1), monkeypatch)
    assert tidy.success
    assert missed.success
    assert missed.simulated > tidy.simulated + 1.0


@pytest.mark.slow
def test_part_that_is_laid_beside_its_place_is_moved_there(monkeypatch: pytest.MonkeyPatch) -> None:
    tidy = run("fine_place", Style(), monkeypatch)
    slipped = run("fine_place", Style(slip=(SLIP, 0.0)), monkeypatch)  # beyond the tolerance of the task
    assert tidy.success
    assert slipped.success
    assert slipped.simulated > tidy.simulated + 1.0
