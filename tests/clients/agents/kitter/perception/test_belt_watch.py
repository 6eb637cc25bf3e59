"""Tracking of parts on the belt."""

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.perception import BeltWatch, Image, Sighting
from cellwright.clients.client import Client
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import BELT, BELT_MIDDLE, BELT_SPEED, BELT_SURFACE

BEAM = Pose.from_rpy((1.6, 2.25, 0.91), (0.0, 0.0, math.pi))


class FakeClient:
    """Time and topics that a test controls."""

    def __init__(self) -> None:
        self.time = 0.0
        self.listeners: dict[str, Callable[[Any], None]] = {}

    def subscribe(self, topic: str, callback: Callable[[Any], None]) -> Callable[[], None]:
        self.listeners[topic] = callback

        def leave() -> None:
            self.listeners.pop(topic, None)

        return leave

    def send(self, topic: str, time: float, **fields: object) -> None:
        self.time = time
        if topic in self.listeners:
            self.listeners[topic](SimpleNamespace(**fields))


def watch(client: FakeClient, beams: dict[str, Pose] | None = None, types: tuple[str, ...] = ()) -> BeltWatch:
    return BeltWatch(cast("Client", client), BELT, beams or {}, types, Catalogue())


def on_belt(part_type: str, y: float, x: float = BELT_MIDDLE, z: float = BELT_SURFACE) -> Sighting:
    return Sighting(part_type, Pose.from_rpy((x, y, z), (0.0, 0.0, 0.5)))


def test_belt_part_is_tracked_beyond_camera_view() -> None:
    belt = watch(FakeClient())
    for index in range(10):
        time = 0.1 * index
        belt.take_image(Image(time, (on_belt("disk_part", 3.0 - BELT_SPEED * time, x=1.2),)))
    (part,) = belt.coming("disk_part", 1.0)
    assert part.has_yaw
    assert part.pose(10.0).position == pytest.approx((1.2, 1.0, BELT_SURFACE))
    assert part.pose(10.0).yaw == pytest.approx(0.5)
    assert part.time_at(-2.0) == pytest.approx(5.0)


def test_belt_parts_are_distinguished_by_type_and_place() -> None:
    belt = watch(FakeClient())
    for time in (0.0, 0.1):
        belt.take_image(
            Image(
                time,
                (
                    on_belt("disk_part", 3.0 - BELT_SPEED * time),
                    on_belt("gear_part", 2.9 - BELT_SPEED * time),
                    on_belt("gear_part", 2.5 - BELT_SPEED * time),
                ),
            )
        )
    assert len(belt.parts) == 3
    first, second = belt.coming("gear_part", 0.1)
    assert first.time_at(0.0) < second.time_at(0.0)


def test_part_above_or_beside_belt_is_ignored() -> None:
    belt = watch(FakeClient())
    belt.take_image(Image(0.0, (on_belt("disk_part", 3.0, z=1.05), on_belt("disk_part", 3.0, x=0.7))))
    assert belt.parts == []


def test_passed_or_taken_part_is_not_coming() -> None:
    belt = watch(FakeClient())
    belt.take_image(Image(0.0, (on_belt("disk_part", 3.0), on_belt("disk_part", 2.5))))
    assert len(belt.coming("disk_part", 23.0)) == 1
    belt.forget(belt.parts[0])
    assert belt.coming("disk_part", 23.0) == []


def test_beam_gives_time_of_part_centre() -> None:
    client = FakeClient()
    belt = watch(client, {"beam": BEAM}, ("gear_part",))
    # read at 20 Hz: the event was 25 ms ago, on average
    client.send("/ariac/beam_change", 10.025, object_detected=True)
    client.send("/ariac/beam_change", 10.425, object_detected=False)
    (part,) = belt.coming("gear_part", 10.5)
    assert not part.has_yaw
    assert part.time_at(-2.25) == pytest.approx(10.2)
    assert part.pose(12.2).position == pytest.approx((BELT_MIDDLE, 1.85, BELT_SURFACE))


def test_beam_with_two_part_types_is_not_used() -> None:
    client = FakeClient()
    belt = watch(client, {"beam": BEAM}, ("gear_part", "disk_part"))
    client.send("/ariac/beam_change", 10.0, object_detected=True)
    client.send("/ariac/beam_change", 10.4, object_detected=False)
    assert belt.parts == []
    assert client.listeners == {}


def test_part_seen_by_camera_is_not_added_by_beam() -> None:
    client = FakeClient()
    belt = watch(client, {"beam": BEAM}, ("gear_part",))
    belt.take_image(Image(0.0, (on_belt("gear_part", 3.0),)))
    client.send("/ariac/beam_change", 3.5, object_detected=True)
    client.send("/ariac/beam_change", 3.9, object_detected=False)
    assert len(belt.parts) == 1
    assert client.listeners == {}


def test_beam_end_without_start_is_ignored() -> None:
    client = FakeClient()
    belt = watch(client, {"beam": BEAM}, ("gear_part",))
    client.send("/ariac/beam_change", 0.1, object_detected=False)
    assert belt.parts == []


@pytest.mark.parametrize(
    ("xyz", "yaw", "crosses"),
    [
        ((1.6, 2.25, 0.91), math.pi, True),
        ((0.8, 2.25, 0.91), 0.0, True),
        ((1.6, 2.25, 0.91), 0.0, False),  # away from the belt
        ((1.6, 2.25, 0.91), math.pi / 2, False),  # along it
        ((1.6, 2.25, 1.2), math.pi, False),  # over the parts
        ((-0.3, 2.25, 0.91), math.pi, False),
    ],
)
def test_belt_is_crossed_only_by_beams_across_parts(xyz: tuple[float, float, float], yaw: float, crosses: bool) -> None:
    assert BELT.is_crossed_by(Pose.from_rpy(xyz, (0.0, 0.0, yaw))) is crosses
