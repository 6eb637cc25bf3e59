"""Tests of the options of a page, and of their refusals."""

from __future__ import annotations

import pytest

from cellwright.cli.arguments import PageAddress, PageArguments
from cellwright.running.run import PageOptions
from cellwright.util.errors import UsageError
from cellwright.viewer.web.start import DEFAULT_PORT


def requested(host: str | None = None, port: int | None = None) -> PageOptions:
    return PageAddress(host, port).options()


def test_page_options_without_view_are_none() -> None:
    assert PageArguments().options() is None


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
