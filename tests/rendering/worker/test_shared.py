"""Shared render process: one for all users, one renderer for equal scenes, and its end with the last user."""

import os
import signal

import numpy as np
import pytest

from cellwright.rendering.backend import BACKEND
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import PictureRequest
from cellwright.rendering.worker import RenderWorker, shared
from cellwright.rendering.worker.shared import SharedRenderer
from cellwright.util.errors import RenderingError
from tests.rendering.scenes_of_shapes import BALL, ball_at
from tests.rendering.test_engine_renderer import PANE, SCENE
from tests.support.waiting import TIMEOUT

CAMERA = Camera((0.3, -4, 1), (0.3, 0, 1))
REQUEST = PictureRequest(CAMERA, 32, 24, samples=1)


@pytest.fixture(autouse=True)
def own_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared, "_process", None)


def test_shared_pictures_of_several_scenes_equal_those_of_own_process() -> None:
    frame = ball_at(0.3, 0, 1)
    ball, glass = SharedRenderer(BALL), SharedRenderer(SCENE)
    assert ball.worker is glass.worker
    large = PictureRequest(CAMERA, 64, 48)
    glass.colour(PANE, large)
    colours, depths = ball.colour(frame, REQUEST), (ball.depth(frame, REQUEST), glass.depth(PANE, REQUEST))
    with RenderWorker(BALL) as own:
        np.testing.assert_array_equal(colours.result(TIMEOUT), own.colour(frame, REQUEST).result(TIMEOUT))
        np.testing.assert_array_equal(depths[0].result(TIMEOUT), own.depth(frame, REQUEST).result(TIMEOUT))
    with RenderWorker(SCENE) as own:
        np.testing.assert_array_equal(depths[1].result(TIMEOUT), own.depth(PANE, REQUEST).result(TIMEOUT))
    ball.close()
    glass.close()


def test_shared_process_ends_with_last_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, "rays")
    first, second = SharedRenderer(BALL), SharedRenderer(BALL)
    assert first.ready is second.ready
    first.close()
    first.close()
    assert second.depth(ball_at(0.3, 0, 1), REQUEST).result(TIMEOUT).shape == (24, 32)
    second.close()
    assert second.worker._process.poll() is not None


def test_user_after_failed_process_starts_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, "rays")
    first = SharedRenderer(BALL)
    first.ready.result(TIMEOUT)
    os.kill(first.worker._process.pid, signal.SIGKILL)
    with pytest.raises(RenderingError):
        first.colour(ball_at(0.3, 0, 1), REQUEST).result(TIMEOUT)
    second = SharedRenderer(BALL)
    assert second.worker is not first.worker
    first.close()
    assert second.depth(ball_at(0.3, 0, 1), REQUEST).result(TIMEOUT).shape == (24, 32)
    second.close()
