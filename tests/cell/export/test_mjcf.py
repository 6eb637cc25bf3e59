"""A cell as MJCF: a fresh process reads the same model, and makes the same motion."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from cellwright import load_trial
from cellwright.cell.export.mjcf import mjcf_text
from cellwright.cell.model.build import build_world
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import UsageError
from tests.cell.arm_cells import ur5_cell
from tests.cell.export.test_description import with_furniture

READ = """
import json, mujoco, sys
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
mujoco.mj_resetDataKeyframe(model, data, model.key("home").id)
for _ in range(200):
    mujoco.mj_step(model, data)
counts = [getattr(model, name) for name in ("nq", "nv", "nu", "ngeom", "nbody", "neq", "nmesh")]
print(json.dumps([counts, float(model.body_mass.sum()), data.qpos.tolist()]))
"""


def furnished(folder: Path) -> Trial:
    return with_furniture(folder)


@pytest.mark.slow
@pytest.mark.parametrize("make", [lambda _: load_trial("final01", "kitter_sensors"), lambda _: ur5_cell(), furnished])
def test_another_process_reads_the_same_model_and_makes_the_same_motion(
    make: Callable[[Path], Trial], tmp_path: Path
) -> None:
    trial, path = make(tmp_path), tmp_path / "cell.xml"
    path.write_text(mjcf_text(trial))
    run = subprocess.run([sys.executable, "-c", READ, path], capture_output=True, text=True, check=True)
    counts, mass, positions = json.loads(run.stdout)
    world = build_world(trial)
    model, data = world.model, world.initial_data()
    assert counts == [getattr(model, name) for name in ("nq", "nv", "nu", "ngeom", "nbody", "neq", "nmesh")]
    assert mass == pytest.approx(float(model.body_mass.sum()), rel=1e-12)
    for _ in range(200):
        mujoco.mj_step(model, data)
    assert np.abs(data.qpos - positions).max() < 1e-12


def test_engine_writes_six_digits_again_afterwards() -> None:
    mjcf_text(ur5_cell())
    spec = mujoco.MjSpec()
    spec.worldbody.add_body(pos=(1 / 3, 0.0, 0.0))
    spec.compile()
    assert 'pos="0.333333 0 0"' in spec.to_xml()


def test_engine_without_the_switch_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ctypes.CDLL", lambda _: object())
    with pytest.raises(UsageError, match=rf"six digits at most \(got mujoco {mujoco.__version__}\); use 4\.0\.1"):
        mjcf_text(ur5_cell())


def test_solver_is_that_of_the_cell() -> None:
    trial = ur5_cell()
    model, ours = mujoco.MjModel.from_xml_string(mjcf_text(trial)), build_world(trial).model
    for name in ("timestep", "integrator", "cone", "impratio", "iterations", "jacobian", "disableflags", "enableflags"):
        assert getattr(model.opt, name) == getattr(ours.opt, name), name
