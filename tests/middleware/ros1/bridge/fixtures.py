"""Fixtures for all tests, through tests/conftest.py."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from tests.middleware.ros1.bridge.fake_cell import FakeCell


@pytest.fixture
def make_cell() -> Iterator[Callable[..., FakeCell]]:
    """Makes fake cells."""
    made: list[FakeCell] = []

    def make(topics: list[dict[str, Any]], services: list[dict[str, Any]] | None = None, **more: Any) -> FakeCell:
        made.append(FakeCell(topics, services, **more))
        return made[-1]

    yield make
    for cell in made:
        cell.close()
