"""A cell with one part of each type for the tests of a module, which start it again; a module may have its own."""

import pytest

from tests.cell.devices.floor import Floor, one_of_each


@pytest.fixture(scope="module")
def shared() -> Floor:
    return Floor(one_of_each())


@pytest.fixture
def floor(shared: Floor) -> Floor:
    return shared.reset()


@pytest.fixture(scope="module")
def original_cell() -> Floor:
    return Floor(one_of_each(), "original")


@pytest.fixture
def original(original_cell: Floor) -> Floor:
    return original_cell.reset()
