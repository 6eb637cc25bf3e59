from contextlib import ExitStack

import pytest

from benchmarks import pybullet_cell
from benchmarks.pybullet_cell import agreement, measure, min_times, pair


def test_pybullet_and_cell_agree_within_tolerance() -> None:
    pytest.importorskip("pybullet")
    with ExitStack() as stack:
        ours, (theirs,) = pair(6, 240, 1, stack, sleeping=(True,), riding=4)
        for side in (ours, theirs):
            side.run(240)
        found = agreement(ours, theirs, 120)
    assert found.resting < 0.5
    assert max(found.belt) < 0.5
    assert found.arm[0] < 2.0
    assert found.arm[1] < 20.0


def test_agreement_reports_standing_belt() -> None:
    pytest.importorskip("pybullet")
    with ExitStack() as stack:
        ours, (theirs,) = pair(2, 240, 1, stack, sleeping=(True,), riding=2)
        for part in ours.cell.world.parts[2:]:
            ours.cell.parts.put_away(part)
        for side in (ours, theirs):
            side.run(120)
        ours_off, theirs_off = agreement(ours, theirs, 60).belt
    assert ours_off == pytest.approx(100.0, abs=0.1)
    assert theirs_off < 1.0


def test_min_times_are_per_step(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[int] = []
    clock = iter([0.0, 4.0, 10.0, 12.0])
    monkeypatch.setattr("time.process_time", lambda: next(clock))

    class Side(pybullet_cell.CellSide):
        def run(self, steps: int) -> None:
            ran.append(steps)

    (best,) = min_times([Side.__new__(Side)], 10, 2)
    assert best == pytest.approx(2.0 / 20 * 1e6)
    assert ran == [30, 20, 20]


@pytest.mark.slow
def test_pybullet_cell_quick_run_yields_bounded_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pybullet")
    for name, value in {"WARM_UP": 1, "WINDOW": 1, "FEW": 1, "MANY": 3, "RATES": (60,)}.items():
        monkeypatch.setattr(pybullet_cell, name, value)
    progress: list[str] = []
    figures = list(measure(progress.append, quick=True))
    assert progress == ["1 parts, 60 Hz", "3 parts, 60 Hz"]
    assert len({figure.label for figure in figures}) == len(figures) == 12
    assert all(figure.value >= 0 for figure in figures)
    assert sum(figure.minimum is not None for figure in figures) == 2
    assert sum(figure.maximum is not None for figure in figures) == 5
    assert all(figure.note for figure in figures if figure.minimum is not None)  # a missed bound needs an explanation
