from pathlib import Path

import pytest

from cellwright.engine.simulation import Simulation
from cellwright.engine.snapshot import Checkpoints, read_checkpoint
from tests.engine.scene import Shaker, make_simulation

MOMENT = 700_000_000
END = 2 * 10**9


def make_run(path: Path | None, *, declared: bool = True, report: list[str] | None = None) -> Simulation:
    simulation = make_simulation()
    checkpoints = Checkpoints(([] if report is None else report).append)
    simulation.add(Shaker())
    simulation.add(checkpoints)
    if declared:
        checkpoints.declare(MOMENT, path)
    simulation.reset()
    return simulation


def test_run_continues_identically_from_its_checkpoint(tmp_path: Path) -> None:
    path = tmp_path / "moment.npz"
    simulation = make_run(path)
    simulation.step_until(END)
    continued = make_run(None, declared=False)
    read_checkpoint(continued, path)
    assert continued.now == MOMENT
    continued.step_until(END)
    assert continued.state_hash() == simulation.state_hash()


def test_state_hash_depends_on_checkpoint_times_and_not_files(tmp_path: Path) -> None:
    written, unwritten = make_run(tmp_path / "moment.npz"), make_run(None)
    undeclared = make_run(None, declared=False)
    for simulation in (written, unwritten, undeclared):
        simulation.step_until(END)
    assert written.state_hash() == unwritten.state_hash() != undeclared.state_hash()


def test_events_in_tick_of_checkpoint_are_saved(tmp_path: Path) -> None:
    path = tmp_path / "moment.npz"  # the shaker pushes at the very tick of the checkpoint
    simulation = make_run(path)
    simulation.step_until(MOMENT)
    shaker = simulation.device("shaker")
    assert isinstance(shaker, Shaker)
    assert shaker.log[-1][0] == MOMENT
    continued = make_run(None, declared=False)
    read_checkpoint(continued, path)
    assert continued.state_hash() == simulation.state_hash()


def test_unwritable_checkpoint_is_reported_and_run_continues(tmp_path: Path) -> None:
    report: list[str] = []
    simulation = make_run(tmp_path / "no such folder" / "moment.npz", report=report)
    simulation.step_until(END)
    assert len(report) == 1
    assert "moment.npz: cannot be written" in report[0]
    written = make_run(tmp_path / "moment.npz")
    written.step_until(END)
    assert simulation.state_hash() == written.state_hash()


@pytest.mark.parametrize("times", [1, 2])
def test_checkpoints_are_taken_in_every_run(tmp_path: Path, times: int) -> None:
    path = tmp_path / "moment.npz"
    simulation = make_run(path)
    for _ in range(times):
        path.unlink(missing_ok=True)
        simulation.reset()
        simulation.step_until(END)
        assert path.exists()


def test_withdrawn_checkpoint_is_not_written(tmp_path: Path) -> None:
    path = tmp_path / "moment.npz"
    simulation = make_run(path)
    checkpoints = simulation.device("checkpoints")
    assert isinstance(checkpoints, Checkpoints)
    checkpoints.withdraw(MOMENT)
    checkpoints.withdraw(MOMENT + 1)
    simulation.reset()
    simulation.step_until(END)
    assert not path.exists()
    undeclared = make_run(None, declared=False)
    undeclared.step_until(END)
    assert simulation.state_hash() == undeclared.state_hash()
