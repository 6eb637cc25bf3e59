"""Images of logical cameras: parts at rest, and their poses with noise averaged out."""

import math
import random

import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.cell.devices.logical_camera import blurred
from cellwright.clients.agents.kitter.perception import Image, Sighting, mean_pose, resting_parts
from cellwright.util.pose import Pose


def images(*parts: Sighting, count: int = 8, drift: float = 0.0) -> list[Image]:
    """Return noisy images of parts, all of which move along -y by `drift` [m] from image to image."""
    rng = random.Random(7)
    noise = [[random_six(rng) for _ in parts] for _ in range(count)]
    return [
        Image(
            0.1 * index,
            tuple(
                Sighting(part.type, blurred(moved(part.world_T_part, -drift * index), six.tolist()))
                for part, six in zip(parts, noise[index], strict=True)
            ),
        )
        for index in range(count)
    ]


def random_six(rng: random.Random) -> NDArray[np.float64]:
    return np.array([rng.gauss(0.0, 1.0) for _ in range(6)])


def moved(pose: Pose, dy: float) -> Pose:
    x, y, z = pose.position
    return Pose((x, y + dy, z), pose.quaternion)


GEAR = Sighting("gear_part", Pose.from_rpy((-0.3, 0.2, 0.725), (0.0, 0.0, 3.1)))
ROD = Sighting("piston_rod_part", Pose.from_rpy((-0.1, 0.2, 0.725), (0.0, 0.0, 0.785)))


def test_resting_part_pose_is_averaged_over_noise() -> None:
    gear, rod = resting_parts(images(GEAR, ROD))
    for found, true in ((gear, GEAR), (rod, ROD)):
        assert found.type == true.type
        assert found.world_T_part.position == pytest.approx(true.world_T_part.position, abs=0.0012)
        turn = math.remainder(found.world_T_part.yaw - true.world_T_part.yaw, 2 * math.pi)
        assert abs(turn) < 0.012
        assert found.is_upright


def test_moving_part_is_not_at_rest() -> None:
    assert resting_parts(images(GEAR, drift=0.02)) == []


def test_part_missing_in_one_image_is_not_at_rest() -> None:
    seen = images(GEAR, ROD)
    seen[3] = Image(0.3, seen[3].parts[:1])
    assert [each.type for each in resting_parts(seen)] == ["gear_part"]


def test_resting_parts_without_images_is_empty() -> None:
    assert resting_parts([]) == []


def test_neighbours_of_same_type_are_distinguished() -> None:
    other = Sighting("gear_part", moved(GEAR.world_T_part, 0.1))
    first, second = resting_parts(images(GEAR, other))
    assert first.world_T_part.position[1] == pytest.approx(0.2, abs=0.0012)
    assert second.world_T_part.position[1] == pytest.approx(0.3, abs=0.0012)


def test_part_on_its_back_is_not_upright() -> None:
    assert not Sighting("pulley_part", Pose.from_rpy((0.0, 0.0, 0.0), (math.pi, 0.0, 0.0))).is_upright


def test_mean_pose_of_opposite_quaternions_is_same_rotation() -> None:
    pose = Pose.from_rpy((1.0, 2.0, 3.0), (0.1, 0.2, 3.0))
    w, x, y, z = pose.quaternion
    mean = mean_pose([pose, Pose(pose.position, (-w, -x, -y, -z))])
    assert mean.quaternion == pytest.approx(pose.quaternion)
    assert mean.position == pytest.approx(pose.position)
