import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.engine import snapshot
from cellwright.engine.simulation import Simulation
from cellwright.engine.snapshot import (
    CheckpointError,
    read_checkpoint,
    restore_snapshot,
    take_snapshot,
    write_checkpoint,
)
from tests.engine.scene import Shaker, make_simulation


def make_run(until: int, *, seed: int = 3) -> Simulation:
    simulation = make_simulation(seed=seed)
    simulation.add(Shaker())
    simulation.reset()
    simulation.step_until(until)
    return simulation


@pytest.mark.parametrize("moment", [20_000_000, 400_000_000, 1_500_000_000])
def test_snapshot_leaves_run_unchanged_and_restores_it(moment: int) -> None:
    undisturbed = make_run(3 * 10**9)
    simulation = make_run(moment)
    taken = take_snapshot(simulation)
    simulation.step_until(3 * 10**9)
    assert simulation.state_hash() == undisturbed.state_hash()
    for _ in range(2):
        restore_snapshot(simulation, taken)
        assert simulation.now == moment
        simulation.step_until(3 * 10**9)
        assert simulation.state_hash() == undisturbed.state_hash()


def test_snapshot_restores_into_identical_simulation() -> None:
    simulation = make_run(10**9)
    twin = make_run(0)
    restore_snapshot(twin, take_snapshot(simulation))
    simulation.step_until(2 * 10**9)
    twin.step_until(2 * 10**9)
    assert twin.state_hash() == simulation.state_hash()


def test_watches_continue_after_restore() -> None:
    simulation = make_run(10**9)
    got: list[int] = []
    simulation.watch("each", Fraction(1, 10), got.append)
    taken = take_snapshot(simulation)
    simulation.step_until(1_200_000_000)
    restore_snapshot(simulation, taken)
    simulation.step_until(1_200_000_000)
    assert got == [11, 12, 11, 12]


CONTINUE = """
import sys
from pathlib import Path
from cellwright.engine.snapshot import read_checkpoint
from tests.engine.test_snapshot import make_run
simulation = make_run(0)
read_checkpoint(simulation, Path(sys.argv[1]))
simulation.step_until(3 * 10**9)
print(simulation.state_hash())
"""


@pytest.mark.slow
@pytest.mark.parametrize("moment", [20_000_000, 1_500_000_000])
def test_checkpoint_continues_identically_in_another_process(tmp_path: Path, moment: int) -> None:
    simulation = make_run(moment)
    path = tmp_path / "run.npz"
    write_checkpoint(simulation, path)
    simulation.step_until(3 * 10**9)
    other = subprocess.run(
        [sys.executable, "-c", CONTINUE, str(path)],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
    )
    assert other.stdout.strip() == simulation.state_hash()


def test_foreign_or_invalid_checkpoint_is_refused(tmp_path: Path) -> None:
    simulation = make_run(0)
    garbage = tmp_path / "garbage.npz"
    garbage.write_bytes(b"PK\x03\x04 and nothing more")
    with pytest.raises(CheckpointError, match=r"garbage\.npz: not a checkpoint"):
        read_checkpoint(simulation, garbage)
    with pytest.raises(CheckpointError, match="not a checkpoint"):
        read_checkpoint(simulation, tmp_path / "missing.npz")
    path = tmp_path / "run.npz"
    write_checkpoint(simulation, path)
    simulation.model.body_mass[1] *= 2
    with pytest.raises(CheckpointError, match="another cell"):
        read_checkpoint(simulation, path)


def rewrite(path: Path, changed: Callable[[dict[str, Any]], object]) -> None:
    """Write the checkpoint again with changed contents."""
    with np.load(path) as file:
        contents: dict[str, Any] = dict(file)
    contents["header"] = json.loads(contents["header"].tobytes())
    changed(contents)
    contents["header"] = np.frombuffer(json.dumps(contents["header"]).encode(), np.uint8)
    np.savez(path, **contents)


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda contents: contents["header"]["state"].update(tick=-5), "was changed since it was written"),
        (lambda contents: contents["header"].pop("state"), "was changed since it was written"),
        (lambda contents: contents.update(engine=contents["engine"][:-1]), "was changed since it was written"),
        (lambda contents: contents.update(engine=np.zeros(3, "U9")), "was changed since it was written"),
        (lambda contents: contents["header"].update(record={"a": {}}), "was changed since it was written"),
        (lambda contents: contents["header"].update(format=1), "made with another cell or another version"),
        (lambda contents: contents.update(header=[1]), "not a checkpoint"),
        (lambda contents: contents.update(engine=np.zeros(1 << 18)), "larger than 1 MiB"),
        (lambda contents: contents.pop("engine"), "not a checkpoint"),
    ],
)
def test_changed_checkpoint_is_refused_and_run_stays_unchanged(
    tmp_path: Path, change: Callable[[dict[str, Any]], object], problem: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(snapshot, "_MAX_SIZE", 1 << 20)
    simulation, path = make_run(0), tmp_path / "c.npz"
    write_checkpoint(simulation, path)
    rewrite(path, change)
    before = simulation.state_hash()
    with pytest.raises(CheckpointError, match=problem):
        read_checkpoint(simulation, path)
    assert simulation.state_hash() == before


@settings(max_examples=50)
@given(st.data())
def test_checkpoint_with_damaged_bytes_is_refused_or_harmless(data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        simulation, path = make_run(0), Path(folder) / "c.npz"
        write_checkpoint(simulation, path)
        before = simulation.state_hash()
        content = bytearray(path.read_bytes())
        cut = data.draw(st.integers(0, len(content) - 1))
        rest = content[cut + 1 :] if data.draw(st.booleans()) else b""
        path.write_bytes(bytes(content[:cut]) + data.draw(st.binary(max_size=20)) + rest)
        with contextlib.suppress(CheckpointError):
            read_checkpoint(simulation, path)
        assert simulation.state_hash() == before


def test_checkpoint_that_is_not_a_regular_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "endless.npz").symlink_to("/dev/zero")
    with pytest.raises(CheckpointError, match=r"not a checkpoint \(not a regular file\)"):
        read_checkpoint(make_run(0), tmp_path / "endless.npz")
