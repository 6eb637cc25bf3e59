"""Observations: arrays of the shapes and types of their space."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest

from cellwright import Cell, load_trial, read_pictures
from cellwright.config.control import ControlSpace
from cellwright.envs.observations import Observations
from cellwright.envs.stepper import CellStepper
from cellwright.util.errors import UnknownNameError


def observations_of(*cameras: str, privileged: bool = True) -> tuple[Observations, CellStepper]:
    trial = load_trial("pick_from_bin")
    stepper = CellStepper(Cell(trial))
    return Observations(trial, ControlSpace.of(trial), cameras, privileged=privileged), stepper


def test_observations_are_in_their_space() -> None:
    observations, stepper = observations_of("overhead")
    with closing(stepper.cell.simulation):
        found = observations.ask(stepper)()
        assert observations.space.contains(found)
        assert sorted(found) == ["agent_pos", "environment_state", "pixels"]
        assert found["agent_pos"].tolist() == np.array(stepper.read(), np.float32).tolist()
        (picture,) = read_pictures([stepper.cell.sensors["overhead"]])  # type: ignore[list-item]
        assert picture.colour is not None
        assert np.array_equal(found["pixels"]["overhead"], picture.colour)


def test_nothing_privileged_is_there_where_it_is_not_wanted() -> None:
    observations, stepper = observations_of(privileged=False)
    found = observations.ask(stepper)()
    assert [*found] == ["agent_pos"]
    assert observations.state_names == ()
    assert observations.space.contains(found)


def test_reading_changes_nothing() -> None:
    observations, stepper = observations_of()
    before = stepper.cell.state_hash()
    observations.ask(stepper)()
    assert stepper.cell.state_hash() == before


def test_cameras_without_colours_are_unknown() -> None:
    with pytest.raises(UnknownNameError, match="logical_camera_bin1"):
        observations_of("logical_camera_bin1")
