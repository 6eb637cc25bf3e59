"""Pictures over the socket: several large ones in one tick, and a client that does not keep up with them."""

from __future__ import annotations

import numpy as np

from cellwright.cell.cell import Cell
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import Image, PointCloud2, Time
from cellwright.middleware.wire.frames import Frame, FrameKind
from tests.cell.devices.workers import FakeWorker
from tests.middleware.server.talk import served

EYE = "{type: rgbd_camera, pose: {xyz: [2.0, 0, 0]}, latency: 0, noise: {colour: 0, depth: 0, depth_growth: 0}}"
CAMERAS = f"cellwright: {{sensors: {{a: {EYE}, b: {EYE}, c: {EYE}}}}}"


def new_cell() -> Cell:
    cell = Cell(load_trial(text=CAMERAS).trial)
    cell.render_service._start = FakeWorker
    return cell


def test_large_messages_of_one_tick_all_arrive() -> None:
    cell = new_cell()
    with served(cell) as hall:
        client = hall.connect("/looker")
        for number, name in enumerate("abc"):
            client.ask(Frame(FrameKind.SUBSCRIBE, 10 + number, f"/ariac/{name}/depth/points"))
            client.ask(Frame(FrameKind.SUBSCRIBE, 20 + number, f"/ariac/{name}/image_raw"))
        cell.simulation.step_until(101_000_000)
        client.wait_until(lambda: all(len(client.messages(n)) == 1 for n in (10, 11, 12, 20, 21, 22)))
        points = TYPES.from_cdr(client.messages(12)[0], PointCloud2)
        assert (points.width, points.height, points.point_step) == (640, 480, 16)
        depths = points.data.view(np.float32).reshape(480, 640, 4)[..., 2]
        assert (depths == 2.0).all()
        image = TYPES.from_cdr(client.messages(20)[0], Image)
        assert len(image.data) == 640 * 480 * 3
        assert not hall.lines


def test_slow_client_loses_pictures_and_memory_is_bounded() -> None:
    cell = new_cell()
    with served(cell) as hall:
        client = hall.connect("/slow")
        client.ask(Frame(FrameKind.SUBSCRIBE, 10, "/ariac/a/depth/points"))
        for picture in range(1, 12):
            cell.simulation.step_until(picture * 100_000_000)
            hall.server.wait(0.0)
        (host,) = hall.server._clients
        assert host.dropped > 0
        assert len(host._out) < 16 << 20
        client.wait_until(lambda: len(client.messages(10)) >= 1 and not host.has_waiting)
        cell.simulation.step_until(1_250_000_000)
        # once it reads, it gets the next picture
        client.wait_until(
            lambda: TYPES.from_cdr(client.messages(10)[-1], PointCloud2).header.stamp == Time(1, 200_000_000)
        )
