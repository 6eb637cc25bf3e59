"""Views of logical cameras."""

import pytest

from cellwright.cell.checks.sight import blind_cameras, corners, looked_at
from cellwright.cell.checks.surfaces import surfaces_in
from cellwright.config.sensors import SensorConfig
from tests.cell.checks.odd import SMALL, camera_over, trial_with


@pytest.mark.parametrize(
    ("camera", "reason"),
    [
        (camera_over("high", -0.4, 0.5, 2.0), "left is 1.28 m from it"),
        (camera_over("low", -0.4, 0.5, 0.8), "left is 0.08 m from it"),
        (camera_over("aside", -3.0, 0.5, 1.2), "none is where it looks"),
    ],
)
def test_camera_without_a_surface_in_view_is_reported_with_the_reason(camera: SensorConfig, reason: str) -> None:
    trial = trial_with(SMALL, camera)
    ((found, message),) = blind_cameras(trial, surfaces_in(trial))
    assert found is camera
    assert reason in message
    assert "from 0.2 to 0.75 m" in message


def test_camera_that_sees_a_bin_is_not_reported() -> None:
    trial = trial_with(SMALL, camera_over("good", -0.4, 0.5, 1.3))
    assert blind_cameras(trial, surfaces_in(trial)) == []


def test_view_is_as_wide_as_at_the_surface_that_is_seen() -> None:
    camera = camera_over("good", -0.4, 0.5, 1.325).pose
    depth = looked_at(camera, surfaces_in(trial_with(SMALL)))
    assert depth == pytest.approx(0.6, abs=1e-6)
    assert looked_at(camera, ()) == 0.75
    # 1.1 rad wide, and 1.5 times as wide as high
    view = corners(camera, depth)
    assert max(y for _, y, _ in view) - min(y for _, y, _ in view) == pytest.approx(0.7357, abs=1e-3)
    assert max(x for x, _, _ in view) - min(x for x, _, _ in view) == pytest.approx(0.4905, abs=1e-3)
