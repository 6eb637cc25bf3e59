"""Render service of cameras: its process may fail, and ends with its users."""

from __future__ import annotations

import gc
import os
import signal
from functools import partial
from typing import Any

import numpy as np
import pytest

from cellwright.engine.simulation import Simulation
from cellwright.rendering.backend import BACKEND
from cellwright.rendering.camera import Pinhole
from cellwright.rendering.cameras.render_service import PendingPicture, RenderService
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.worker import RenderWorker
from cellwright.util.pose import Pose
from tests.cell.devices.scene import add_part, empty_spec, make_simulation, move
from tests.cell.devices.workers import FakeWorker


def ask(service: RenderService) -> PendingPicture | None:
    return service.ask(Pinhole(16, 12, 1.0), Pose((-1.0, 0.0, 0.0)), colour=False, depth=True)


def room() -> Simulation:
    spec = empty_spec()
    add_part(spec, "part", Pose((0.0, 0.0, 0.0)))
    spec.body("part").add_geom(type=6, size=[0.1, 0.1, 0.1], group=2, contype=0, conaffinity=0, mass=0)
    return make_simulation(spec)


def serve(simulation: Simulation, start: Any, **options: Any) -> RenderService:
    return RenderService(simulation, partial(SceneCapture, simulation.model), start, about=(0.0, 0.0, 0.0), **options)


def process_of(service: RenderService) -> Any:
    return service._worker._process  # type: ignore[union-attr]


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["", "rays"])
def test_drawn_picture_shows_tick_of_request(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, backend)
    simulation = room()
    service = serve(simulation, RenderWorker)
    requests = []
    for x in (0.0, 0.5):
        move(simulation, "part", Pose((x, 0.0, 0.0)))
        simulation.step()
        requests.append(ask(service))
    for pending, distance in zip(requests, (0.8, 1.3), strict=True):  # the drawn part is four times as large
        assert pending is not None
        drawn = service.fetch(pending)
        assert drawn is not None
        assert drawn[1] is not None
        assert drawn[1][6, 8] == pytest.approx(distance, abs=1e-4)
    process = process_of(service)
    service.close()
    assert process.poll() is not None


@pytest.mark.slow
def test_killed_process_is_reported_once_and_draws_no_more() -> None:
    lines: list[str] = []
    service = serve(room(), RenderWorker, report=lines.append)
    pending = ask(service)
    assert pending is not None
    assert service.fetch(pending) is not None
    late = ask(service)
    assert late is not None
    os.kill(process_of(service).pid, signal.SIGKILL)
    found = [
        service.fetch(late),
        *(None if pending is None else service.fetch(pending) for pending in [ask(service)] * 2),
    ]
    assert found[1:] == [None, None]
    assert len(lines) == 1
    assert lines[0].startswith("cameras are off for the rest of this run: render process has ended")
    assert ask(service) is None
    service.reopen()
    again = ask(service)
    assert again is not None
    drawn = service.fetch(again)
    assert drawn is not None
    assert np.isfinite(drawn[1]).any()  # type: ignore[arg-type]
    service.close()


@pytest.mark.slow
def test_picture_that_was_asked_before_the_close_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, "rays")
    service = serve(room(), RenderWorker)
    pending = ask(service)
    process = process_of(service)
    service.close()
    assert process.poll() is not None
    assert pending is not None
    drawn = service.fetch(pending)
    assert drawn is not None
    assert np.isfinite(drawn[1]).any()  # type: ignore[arg-type]
    assert service._worker is None


@pytest.mark.slow
def test_deleted_service_releases_process() -> None:
    workers: list[FakeWorker] = []

    def start(scene: Any) -> FakeWorker:
        workers.append(FakeWorker(scene))
        return workers[-1]

    service = serve(room(), start)
    ask(service)
    del service
    gc.collect()
    assert workers[0].is_closed


def test_cameras_of_one_tick_share_frame() -> None:
    service = serve(simulation := room(), FakeWorker)
    for _ in range(2):
        ask(service)
    simulation.step()
    ask(service)
    worker: Any = service._worker
    first, second, third = (frame for frame, _, _ in worker.asked)
    assert first is second
    assert (first.time, third.time) == (0, 2_000_000)
