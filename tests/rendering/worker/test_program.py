"""Render process within this one: each request has one answer, also a wrong one."""

import io
from queue import SimpleQueue
from typing import Any

import numpy as np
import pytest

from cellwright.rendering import backend
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import CastRenderer, PictureRequest
from cellwright.rendering.worker import wire
from cellwright.rendering.worker.program import Drawing, _backends
from tests.rendering.scenes_of_shapes import BALL, ball_at

REQUEST = PictureRequest(Camera((0, -4, 2), (0, 0, 1)), 16, 9, samples=1)


def answers(*requests: tuple[str, tuple[Any, ...]]) -> list[tuple[int, Any, str]]:
    """Return number, value and error of each answer."""
    queue: SimpleQueue[Any] = SimpleQueue()
    for number, (method, arguments) in enumerate(requests):
        queue.put((number, method, arguments))
    queue.put(None)
    pipe = io.BytesIO()
    Drawing(CastRenderer, pipe).work(queue)
    pipe.seek(0)
    return [*iter(lambda: wire.read(pipe), None)]


def test_scene_is_drawn_until_it_is_forgotten() -> None:
    draw = ("colour", (7, ball_at(0, 0, 1), REQUEST))
    scene, colour, depth, gone, late = answers(
        ("scene", (7, BALL)), draw, ("depth", (7, ball_at(0, 0, 1), REQUEST)), ("forget", (7,)), draw
    )
    assert scene == (0, backend.RAYS, "")
    assert colour[1].shape == (9, 16, 3)
    assert (depth[1].shape, depth[1].dtype) == ((9, 16), np.float32)
    assert gone == (3, None, "")
    assert late == (4, None, "no scene to draw")


def test_wrong_requests_are_answered_and_the_next_one_is_carried_out() -> None:
    too_large = PictureRequest(REQUEST.camera, 5000, 9)
    found = answers(
        ("take", (ball_at(0, 0, 1), REQUEST, "", 0)),
        ("colour", (0, ball_at(0, 0, 1), too_large)),
        ("nonsense", ()),
        ("finish", ()),
    )
    assert [number for number, _, _ in found] == [0, 1, 2, 3]
    assert [value for _, value, _ in found] == [None, None, None, 0]
    errors = [error for _, _, error in found]
    assert errors[0] == "no video is open"
    assert "picture width must be between" in errors[1]
    assert "_do_nonsense" in errors[2]
    assert errors[3] == ""


@pytest.mark.parametrize(
    ("value", "first"), [(backend.RAYS, backend.RAYS), (backend.OPENGL_BACKENDS[0], backend.OPENGL_BACKENDS[0])]
)
def test_requested_backend_comes_first_and_rays_come_last(
    monkeypatch: pytest.MonkeyPatch, value: str, first: str
) -> None:
    monkeypatch.setenv(backend.BACKEND, value)
    now, others = _backends([])
    assert now == first
    assert [now, *others][-1] == backend.RAYS
    assert _backends(["egl", "rays"]) == ("egl", ["rays"])
