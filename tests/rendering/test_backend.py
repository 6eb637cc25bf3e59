"""Backend in the environment: an existing one, or an error that lists them."""

from __future__ import annotations

import pytest

from cellwright.rendering.backend import BACKEND, BACKENDS, requested_backend
from cellwright.rendering.worker import RenderWorker
from cellwright.util.errors import UsageError
from tests.rendering.scenes_of_shapes import BALL


@pytest.mark.parametrize("backend", ["", *BACKENDS])
def test_what_exists_is_taken(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, backend)
    assert requested_backend() == backend


def test_nothing_need_be_settled(monkeypatch: pytest.MonkeyPatch) -> None:
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
def test_an_unknown_backend_is_refused_in_a_line(backend: str, reason: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, backend)
    with pytest.raises(UsageError) as refused:
        requested_backend()
    assert reason in str(refused.value)
    assert str(refused.value).isprintable()


def test_no_other_backend_draws_instead(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, "ray")
    with pytest.raises(UsageError, match="did you mean rays"):
        RenderWorker(BALL)
