"""Cameras that take pictures: their drawing and delivery, and late pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.sensors import PictureCameraConfig, PictureNoise
from cellwright.engine.simulation import Simulation
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera, read_pictures
from cellwright.rendering.cameras.render_service import RenderService
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.cell.devices.scene import add_part, empty_spec, make_simulation, push
from tests.cell.devices.workers import FakeWorker

MS = 1_000_000  # [ns]
SILENT = PictureNoise(0.0, 0.0, 0.0)
EYE = PictureCameraConfig("eye", "rgbd_camera", Pose((2.0, 0.0, 0.0)), width=16, height=8, noise=SILENT)


class Room:
    """Part that glides by, a camera, and its reports."""

    def __init__(self, camera: PictureCameraConfig = EYE) -> None:
        spec = empty_spec()
        add_part(spec, "part", Pose((0.0, 0.0, 0.0)))
        self.simulation: Simulation = make_simulation(spec)
        self.workers: list[FakeWorker] = []
        self.lines: list[str] = []
        capture = partial(SceneCapture, self.simulation.model)
        self.service = RenderService(
            self.simulation, capture, self._start, about=(0.0, 0.0, 0.0), report=self.lines.append
        )
        self.camera = PictureCamera(camera, self.service, report=self.lines.append)
        self.simulation.add(self.camera)
        self.simulation.reset()
        push(self.simulation, "part", (0.1, 0.0, 0.0))
        self.pictures: list[tuple[int, Picture]] = []

    def _start(self, scene: Any) -> FakeWorker:
        self.workers.append(FakeWorker(scene))
        return self.workers[-1]

    @property
    def worker(self) -> FakeWorker:
        return self.workers[-1]

    def look(self, *, colour: bool = True, depth: bool = True) -> Callable[[], None]:
        return self.camera.look(
            lambda picture: self.pictures.append((self.simulation.now, picture)), colour=colour, depth=depth
        )

    def run(self, milliseconds: int) -> None:
        self.simulation.step_until(milliseconds * MS)


def test_picture_comes_one_period_after_its_tick() -> None:
    room = Room()
    room.look()
    room.run(420)
    assert [(now // MS, picture.time_ns // MS, picture.sample) for now, picture in room.pictures] == [
        (200, 100, 1),
        (300, 200, 2),
        (400, 300, 3),
    ]
    colour = room.pictures[0][1].colour
    assert colour is not None
    assert colour.shape == (8, 16, 3)
    assert (colour == 100).all()
    assert not colour.flags.writeable


@pytest.mark.parametrize(("latency", "due"), [(0.0, [100, 200]), (0.03, [130, 230]), (0.25, [350, 450])])
def test_latency_is_independent_of_drawing_time(latency: float, due: list[int]) -> None:
    room = Room(replace(EYE, latency=latency))
    room.look()
    room.run(2)
    room.run(470)
    assert [now // MS for now, _ in room.pictures][:2] == due
    assert [picture.time_ns // MS for _, picture in room.pictures][:2] == [100, 200]


def test_camera_without_listeners_draws_nothing() -> None:
    room = Room()
    room.run(300)
    assert not room.workers
    leave = room.look()
    room.run(450)
    assert room.worker.count == 1
    leave()
    leave()
    assert not room.worker.fetched
    room.run(900)
    assert room.worker.count == 1
    assert not room.pictures


@pytest.mark.parametrize(("colour", "depth"), [(True, False), (False, True), (True, True), (False, False)])
def test_only_requested_channels_are_drawn(colour: bool, depth: bool) -> None:
    room = Room()
    room.look(colour=colour, depth=depth)
    room.run(250)
    ((_, picture),) = room.pictures
    assert (picture.colour is not None, picture.depth is not None) == (colour, depth)
    if not (colour or depth):
        assert not room.workers


def test_picture_for_several_listeners_is_drawn_once() -> None:
    room = Room()
    leave = room.look(colour=True, depth=False)
    room.look(colour=False, depth=True)
    room.run(150)
    assert [kinds for _, _, kinds in room.worker.asked] == [["colour", "depth"]]
    leave()
    room.run(250)
    assert [kinds for _, _, kinds in room.worker.asked[1:]] == [["depth"]]
    ((_, picture),) = room.pictures  # the remaining listener gets the channels requested for both
    assert picture.colour is not None


@pytest.mark.parametrize(("kind", "channel"), [("rgb_camera", "depth"), ("depth_camera", "colour")])
def test_camera_without_channel_refuses_it(kind: str, channel: str) -> None:
    room = Room(replace(EYE, type=kind))
    with pytest.raises(UsageError, match=f"a {kind} has no "):
        room.look(colour=channel == "colour", depth=channel == "depth")


def test_listener_gets_all_channels_of_camera() -> None:
    room = Room(replace(EYE, type="depth_camera"))
    found: list[Picture] = []
    room.camera.listen(found.append)
    room.run(210)
    assert found[0].colour is None
    assert found[0].depth is not None


def test_depth_out_of_range_is_not_measured() -> None:
    for x, measured in ((0.05, False), (0.1001, True), (9.9, True), (10.1, False)):
        room = Room(replace(EYE, pose=Pose((x, 0.0, 0.0))))
        room.look()
        room.run(210)
        depth = room.pictures[0][1].depth
        assert depth is not None
        assert np.isfinite(depth).all() == measured
        assert np.isnan(depth).all() != measured


def test_noise_depends_on_sample_only() -> None:
    noisy = replace(EYE, noise=PictureNoise(0.02, 0.01, 0.0))

    def taken(from_the_start: bool) -> Picture:
        room = Room(noisy)
        if not from_the_start:
            room.run(350)
        room.look()
        room.run(510)
        return room.pictures[-1][1]

    one, other = taken(from_the_start=True), taken(from_the_start=False)
    assert one.sample == other.sample == 4
    assert one.colour is not None
    assert one.depth is not None
    np.testing.assert_array_equal(one.colour, other.colour)
    np.testing.assert_array_equal(one.depth, other.depth)
    assert np.std(one.colour) > 2
    assert 0.005 < np.std(one.depth) < 0.02


def test_camera_moves_with_its_body() -> None:
    room = Room(replace(EYE, frame="part", pose=Pose((1.0, 0.0, 0.0))))
    room.look()
    room.run(310)
    stood = [picture.world_T_camera.position[0] for _, picture in room.pictures]
    assert stood == pytest.approx([1.01, 1.02], abs=1e-4)


def test_read_waits_for_current_picture() -> None:
    room = Room()
    room.run(50)
    picture = room.camera.read()
    assert picture.time_ns == 50 * MS
    assert picture.colour is not None
    assert picture.depth is not None


def test_simulation_waits_for_late_picture() -> None:
    room = Room(replace(EYE, when_late="wait"))
    room.simulation.is_paced = True
    room.look()
    room.run(150)
    room.worker.is_quick = False  # fetching waits
    room.run(410)
    assert [picture.sample for _, picture in room.pictures] == [1, 2, 3]
    assert room.camera.dropped == 0


def test_late_picture_comes_later_and_others_are_dropped() -> None:
    room = Room(replace(EYE, when_late="drop"))
    room.look()
    room.run(150)
    room.worker.is_quick = False
    room.run(350)
    assert not room.pictures
    assert (room.worker.count, room.camera.dropped) == (1, 2)  # none was begun meanwhile
    room.worker.is_quick = True
    room.run(510)
    assert [(now // MS, picture.sample) for now, picture in room.pictures] == [(352, 1), (500, 4)]


def test_camera_without_latency_always_waits() -> None:
    room = Room(replace(EYE, when_late="drop", latency=0.0))
    room.look()
    room.run(110)
    room.worker.is_quick = False
    room.run(310)
    assert [(now // MS, picture.sample) for now, picture in room.pictures] == [(100, 1), (200, 2), (300, 3)]
    assert room.camera.dropped == 0


def test_dropped_pictures_are_reported_once_per_second() -> None:
    room = Room(replace(EYE, when_late="drop"))
    room.look()
    room.run(110)
    room.worker.is_quick = False
    room.run(2500)
    assert room.lines[0] == ("camera eye: 1 picture dropped (1 in all); drawing takes longer than the camera's period")
    assert len(room.lines) == 3
    assert "pictures dropped" in room.lines[1]


def test_dropped_pictures_are_not_reported_until_worker_is_ready() -> None:
    room = Room(replace(EYE, when_late="drop"))
    room.look()
    room.run(110)
    room.worker.is_quick = room.worker.has_begun = False
    room.run(2500)
    assert room.camera.dropped > 10
    assert not room.lines


@pytest.mark.parametrize("is_paced", [False, True])
def test_auto_drops_pictures_in_paced_simulation_only(is_paced: bool) -> None:
    room = Room()
    room.simulation.is_paced = is_paced
    room.look()
    room.run(150)
    room.worker.is_quick = False
    room.run(210)
    assert (room.camera.dropped > 0, len(room.pictures)) == (is_paced, 0 if is_paced else 1)


def test_failed_worker_is_reported_once_and_run_continues() -> None:
    room = Room()
    room.look()
    room.run(250)
    room.worker.is_broken = True
    room.run(900)
    assert room.lines == ["cameras are off for the rest of this run: the brush is broken"]
    assert room.worker.is_closed
    assert len(room.pictures) == 1
    with pytest.raises(UsageError, match="rendering has failed"):
        room.camera.read()


def test_reset_retries_failed_worker() -> None:
    room = Room()
    room.look()
    room.run(150)
    room.worker.is_broken = True
    room.run(250)
    room.simulation.reset()
    room.run(210)
    assert len(room.workers) == 2
    assert [picture.sample for _, picture in room.pictures] == [1]


def test_disabled_camera_takes_none_and_drops_pending_pictures() -> None:
    room = Room()
    room.look()
    room.run(150)
    room.camera.enabled = False
    room.run(350)
    assert (room.worker.count, room.worker.fetched, room.pictures) == (1, [], [])
    room.camera.enabled = True
    room.run(510)
    assert [picture.sample for _, picture in room.pictures] == [4]


def test_restored_snapshot_drops_pending_pictures() -> None:
    room = Room()
    room.run(50)
    moment = take_snapshot(room.simulation)
    room.look()
    room.run(250)
    restore_snapshot(room.simulation, moment)
    room.run(210)
    assert [picture.time_ns // MS for _, picture in room.pictures] == [100, 100]
    assert room.worker.fetched == [1, 3]


def test_closed_camera_releases_worker() -> None:
    room = Room()
    room.look()
    room.run(150)
    room.simulation.close()
    assert room.worker.is_closed


@given(rate=st.sampled_from([1.0, 7.5, 10.0, 29.97, 100.0]), latency=st.floats(0.0, 0.2), ticks=st.integers(1, 200))
def test_picture_comes_at_first_tick_after_latency(rate: float, latency: float, ticks: int) -> None:
    room = Room(replace(EYE, rate=rate, latency=latency))
    room.look(colour=False, depth=True)
    for _ in range(ticks):
        room.simulation.step()
    wait = round(Fraction(repr(latency)) * 10**9)
    for now, picture in room.pictures:
        assert now >= picture.time_ns + wait > now - 2 * MS
        assert picture.time_ns >= picture.sample * Fraction(10**9) / Fraction(repr(rate)) - 1


def test_read_pictures_of_cells_requests_all_before_it_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    rooms = [Room(), Room(replace(EYE, width=8))]
    rooms[1].run(20)
    fetched_at_request: list[int] = []
    colour = FakeWorker.colour

    def note(self: FakeWorker, *arguments: Any) -> Any:
        fetched_at_request.append(sum(len(room.worker.fetched) for room in rooms if room.workers))
        return colour(self, *arguments)

    monkeypatch.setattr(FakeWorker, "colour", note)
    pictures = read_pictures([room.camera for room in rooms])
    assert fetched_at_request == [0, 0]
    assert [picture.time_ns // MS for picture in pictures] == [0, 20]
    for room, picture in zip(rooms, pictures, strict=True):
        alone = room.camera.read()
        np.testing.assert_array_equal(picture.colour, alone.colour)
        np.testing.assert_array_equal(picture.depth, alone.depth)


def test_read_pictures_of_disabled_camera_is_refused() -> None:
    room = Room()
    room.camera.enabled = False
    with pytest.raises(UsageError, match="switched off"):
        read_pictures([room.camera])
