"""Tests of the options of a page, and of their refusals."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.cli.arguments import page_options, refuse_camera_name
from cellwright.rendering.camera import VIEWS
from cellwright.running.run import PageOptions
from cellwright.util.errors import UsageError
from cellwright.viewer.web.start import DEFAULT_PORT


def requested(host: str | None = None, port: int | None = None) -> PageOptions:
    found = page_options(view=True, host=host, port=port, opens=False)
    assert found is not None
    return found


def test_page_options_without_view_are_none() -> None:
    assert page_options(view=False, host=None, port=None, opens=False) is None


@pytest.mark.parametrize("host", [None, "127.0.0.1", "127.0.0.2", "::1", "localhost"])
def test_loopback_page_has_no_token(host: str | None) -> None:
    assert requested(host).token == ""
    assert requested(host).port == DEFAULT_PORT


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "lab-pc"])
def test_network_pages_have_different_tokens(host: str) -> None:
    first, second = requested(host).token, requested(host).token
    assert len(first) >= 20
    assert first != second


@pytest.mark.parametrize("port", [-1, 65536])
def test_invalid_port_is_refused(port: int) -> None:
    with pytest.raises(UsageError, match="--view-port"):
        requested(port=port)


@pytest.mark.parametrize("name", list(VIEWS))
def test_camera_name_after_view_is_refused_unless_it_is_a_file(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    refuse_camera_name(["lesson", name], view=False)
    with pytest.raises(UsageError, match=f"--camera {name}"):
        refuse_camera_name(["lesson", name], view=True)
    (tmp_path / name).write_text("{}")
    refuse_camera_name(["lesson", name], view=True)
