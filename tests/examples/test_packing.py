"""The example of a parallel gripper: a short program packs cubes to full points, and touches nothing else."""

import importlib.util
from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.config.trial.gear2017 import load_trial
from cellwright.running.run import Outcome, RunOptions, run_cell

FOLDER = Path(__file__).parents[2] / "examples" / "packing"


@pytest.mark.parametrize("holds", ["friction", "weld"])
def test_cubes_are_packed_to_full_points(holds: str, tmp_path: Path) -> None:
    assert len((FOLDER / "packer.py").read_text().splitlines()) <= 60
    found = importlib.util.spec_from_file_location("packer", FOLDER / "packer.py")
    assert found is not None
    assert found.loader is not None
    packer = importlib.util.module_from_spec(found)
    found.loader.exec_module(packer)
    path = tmp_path / "cell.yaml"
    path.write_text((FOLDER / "cell.yaml").read_text().replace("holds: friction", f"holds: {holds}"))
    loaded = load_trial([path])
    assert loaded.warnings == ()
    result = run_cell(Cell(loaded.trial), packer.Packer(), RunOptions(until=60.0))
    assert (result.error, result.outcome, result.score.total) == ("", Outcome.DONE, 6.0)
    assert result.collisions == ()
