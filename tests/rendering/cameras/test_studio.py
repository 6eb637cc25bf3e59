"""Render service of cameras: its process may fail, and ends with its users."""

from __future__ import annotations

import gc
import os
import signal
from typing import Any

import numpy as np
import pytest

from cellwright.engine.simulation import Simulation
from cellwright.rendering.backend import BACKEND
from cellwright.rendering.camera import Pinhole
from cellwright.rendering.cameras.studio import PendingPicture, RenderService
from cellwright.util.pose import Pose
from tests.cell.devices.scene import add_part, empty_spec, make_simulation, move
from tests.cell.devices.workers import FakeWorker


def ask(studio: RenderService) -> PendingPicture | None:
    return studio.ask(Pinhole(16, 12, 1.0), Pose((-1.0, 0.0, 0.0)), colour=False, depth=True)


def room() -> Simulation:
    spec = empty_spec()
    add_part(spec, "part", Pose((0.0, 0.0, 0.0)))
    spec.body("part").add_geom(type=6, size=[0.1, 0.1, 0.1], group=2, contype=0, conaffinity=0, mass=0)
    return make_simulation(spec)


def process_of(studio: RenderService) -> Any:
    return studio._worker._process  # type: ignore[union-attr]


@pytest.mark.slow
@pytest.mark.parametrize("way", ["", "rays"])
def test_what_is_drawn_is_the_tick_that_it_was_asked_for_in(way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, way)
    simulation = room()
    studio = RenderService(simulation)
    requests = []
    for x in (0.0, 0.5):
        move(simulation, "part", Pose((x, 0.0, 0.0)))
        simulation.step()
        requests.append(ask(studio))
    for pending, distance in zip(requests, (0.8, 1.3), strict=True):  # the drawn part is four times as large
        assert pending is not None
        drawn = studio.fetch(pending)
        assert drawn is not None
        assert drawn[1] is not None
        assert drawn[1][6, 8] == pytest.approx(distance, abs=1e-4)
    process = process_of(studio)
    studio.close()
    assert process.poll() is not None


@pytest.mark.slow
def test_a_killed_process_is_reported_once_and_nothing_more_is_drawn() -> None:
    lines: list[str] = []
    studio = RenderService(room(), report=lines.append)
    pending = ask(studio)
    assert pending is not None
    assert studio.fetch(pending) is not None
    late = ask(studio)
    assert late is not None
    os.kill(process_of(studio).pid, signal.SIGKILL)
    found = [studio.fetch(late), *(None if pending is None else studio.fetch(pending) for pending in [ask(studio)] * 2)]
    assert found[1:] == [None, None]
    assert len(lines) == 1
    assert lines[0].startswith("cameras take no more pictures in this run: the process that draws has ended")
    assert ask(studio) is None
    studio.reopen()
    again = ask(studio)
    assert again is not None
    drawn = studio.fetch(again)
    assert drawn is not None
    assert np.isfinite(drawn[1]).any()  # type: ignore[arg-type]
    studio.close()


@pytest.mark.slow
def test_a_studio_that_is_forgotten_lets_its_process_go() -> None:
    workers: list[FakeWorker] = []

    def start(scene: Any) -> FakeWorker:
        workers.append(FakeWorker(scene))
        return workers[-1]

    studio = RenderService(room(), start)
    ask(studio)
    del studio
    gc.collect()
    assert workers[0].is_closed


def test_cameras_of_one_tick_share_its_frame() -> None:
    studio = RenderService(simulation := room(), FakeWorker)
    for _ in range(2):
        ask(studio)
    simulation.step()
    ask(studio)
    worker: Any = studio._worker
    first, second, third = (frame for frame, _, _ in worker.asked)
    assert first is second
    assert (first.time, third.time) == (0, 2_000_000)
