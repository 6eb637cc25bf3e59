"""Backend in the environment: an existing one, or an error that lists them."""

from __future__ import annotations

import pytest

from cellwright.rendering.backend import BACKEND, BACKENDS, requested_backend
from cellwright.rendering.worker import RenderWorker
from cellwright.util.errors import UsageError
from tests.rendering.scenes_of_shapes import BALL


@pytest.mark.parametrize("backend", ["", *BACKENDS])
def test_known_backend_is_accepted(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, backend)
    assert requested_backend() == backend


def test_unset_backend_is_empty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(BACKEND, raising=False)
    assert requested_backend() == ""


@pytest.mark.parametrize(
    ("backend", "reason"),
    [
        ("ray", "=ray: unknown backend; set one of egl, osmesa, cgl, glfw, rays, or unset it; did you mean rays"),
        ("EGL", "; did you mean egl"),
        ("\x1b[2J\nboo", r"=\x1b[2J boo: unknown backend; set one of"),
    ],
)
def test_unknown_backend_is_refused_in_one_line(backend: str, reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, backend)
    with pytest.raises(UsageError) as refused:
        requested_backend()
    assert reason in str(refused.value)
    assert str(refused.value).isprintable()


def test_worker_with_unknown_backend_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, "ray")
    with pytest.raises(UsageError, match="did you mean rays"):
        RenderWorker(BALL)
