"""Bundled trials equal the public ones, figure for figure; the bundled sensors cover their targets."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import yaml

from cellwright.cell.devices.logical_camera import LogicalCamera
from cellwright.cell.devices.scene import Frustum
from cellwright.config.trial.catalogue import (
    BASELINE,
    DROPPED_PART,
    KIT_CHANGE,
    LESSON,
    QUALIFIER,
    SAMPLE,
    TASK,
    all_bundled,
    bundled,
    bundled_sensors,
    bundled_tasks,
    find_trial,
    scenario,
)
from cellwright.config.trial.gear2017 import load_trial, resolved
from cellwright.config.trial.trial import Trial
from tests.conftest import DATA
from tests.support.places import BIN_CENTRES, LAYOUT

TRIALS: dict[str, Any] = json.loads((DATA / "gear2017_trials.json").read_text())["trials"]


def test_every_public_trial_is_bundled() -> None:
    assert set(bundled()) == {*TRIALS, "lesson"}


@pytest.mark.parametrize("name", TRIALS)
def test_bundled_trial_resolves_to_public_values(name: str) -> None:
    figures = load_trial([find_trial(name)])
    assert json.loads(json.dumps(resolved(figures))) == TRIALS[name]["resolved"]


@pytest.mark.slow
@pytest.mark.parametrize("name", TRIALS)
def test_bundled_trial_equals_public_file(name: str) -> None:
    def normalized(trial: Trial) -> Trial:
        """Leave out settings without effect: an unused log, and `insert_models_over_bins` without such parts."""
        inserts = trial.options.insert_models_over_bins and bool(trial.bin_parts)
        options = replace(trial.options, gazebo_state_logging=False, insert_models_over_bins=inserts)
        return replace(trial, name="", options=options)

    public = load_trial(text=yaml.safe_dump(TRIALS[name]["config"], sort_keys=False)).trial
    assert normalized(load_trial([find_trial(name)]).trial) == normalized(public)


@pytest.mark.parametrize("name", all_bundled())
def test_bundled_trial_starts_with_comment(name: str) -> None:
    first = find_trial(name).read_text(encoding="utf-8").splitlines()[0]
    assert first.startswith("# ")


@pytest.mark.slow
@pytest.mark.parametrize("name", bundled())
def test_bundled_trial_joins_with_sensor_files(name: str) -> None:
    for sensors in bundled_sensors():
        trial = load_trial([find_trial(name), find_trial(sensors)]).trial
        assert trial.has_arm
        assert trial.sensors == load_trial([find_trial(sensors)]).trial.sensors


def test_tasks_are_trials_of_their_own_scenario() -> None:
    assert not {*bundled_tasks()} & {*bundled()}
    assert {scenario(name) for name in bundled_tasks()} == {TASK}
    assert all(find_trial(name).parent.name == "tasks" for name in bundled_tasks())


def test_scenario_follows_from_trial_name() -> None:
    assert [scenario(name) for name in ("lesson", "sample", "comp_conf1", "qual3b")] == [
        LESSON,
        SAMPLE,
        SAMPLE,
        QUALIFIER,
    ]
    assert [scenario(f"final{number:02}") for number in (1, 5, 6, 10, 11, 15)] == [
        *[BASELINE] * 2,
        *[DROPPED_PART] * 2,
        *[KIT_CHANGE] * 2,
    ]


def in_view(points: list[tuple[float, float, float]]) -> bool:
    """Return for each point whether at least one of the bundled cameras sees it."""
    cameras = [
        Frustum(
            sensor.pose,
            near=LogicalCamera.near,
            far=LogicalCamera.far,
            horizontal_fov=LogicalCamera.horizontal_fov,
            aspect=LogicalCamera.aspect,
        )
        for sensor in load_trial([find_trial("kitter_sensors")]).trial.sensors
        if sensor.type == "logical_camera"
    ]
    centres = np.array(points)
    return bool(np.any([camera.meets(centres, np.full_like(centres, 1e-3)) for camera in cameras], axis=0).all())


def corners(x: float, y: float, z: float, half_x: float, half_y: float) -> list[tuple[float, float, float]]:
    return [(x + side * half_x, y + end * half_y, z) for side in (-1, 1) for end in (-1, 1)]


@pytest.mark.parametrize("name", ["bin5", "bin6", "bin7", "bin8"])
def test_bin_is_in_view_of_sensors(name: str) -> None:
    x, y = BIN_CENTRES[name]
    assert in_view(corners(x, y, 0.726, 0.3, 0.3))
    assert not in_view(corners(x, y, 0.726, 0.5, 0.5))


@pytest.mark.parametrize("frame", LAYOUT.tray_frames)
def test_tray_is_in_view_of_sensors(frame: str) -> None:
    x, y, _ = LAYOUT.tray_frames[frame].position
    assert in_view(corners(x, y, 0.756, 0.25, 0.35))


def test_belt_before_break_beam_is_in_view_of_sensors() -> None:
    assert in_view([(1.21, y, 0.915) for y in (2.16, 2.6, 3.04)])
    assert not in_view([(1.21, 3.1, 0.915)])
