"""Services of worlds in `simulation_interfaces`: trials are worlds."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright import load_trial
from cellwright.viewer.services.simulation import LOADING, NO_WORLD, PLAYING
from cellwright.viewer.services.simulation_requests import (
    INCORRECT_STATE,
    INCORRECT_TRANSITION,
    NO_WORLD_LOADED,
    NOT_FOUND,
    OK,
    UNSUPPORTED,
)
from cellwright.viewer.services.world_services import NO_LOADING, UNLOADED
from tests.viewer.services.simulated import Services


@pytest.fixture(scope="module")
def shared() -> Services:
    """Services for tests that change nothing."""
    return Services()


def test_worlds_are_trials(shared: Services) -> None:
    assert shared("GetCurrentWorld")["world"]["name"] == "lesson"
    worlds = shared("GetAvailableWorlds")["worlds"]
    assert {"lesson", "final01", "qual1a", "pick_from_bin"} < {each["name"] for each in worlds}
    finals = shared("GetAvailableWorlds", filter={"tags": ["final, dropped part"]})["worlds"]
    assert [each["name"] for each in finals] == ["final06", "final07", "final08", "final09", "final10"]
    assert shared.code("GetAvailableWorlds", additional_sources=["x"])[0] == UNSUPPORTED


def test_world_is_loaded_by_name_or_text() -> None:
    for request, name in (
        ({"uri": "final01"}, "final01"),
        ({"world_resource": {"uri": "final01"}}, "final01"),  # of version 2
        ({"uri": "final01", "resource_string": "time_limit: soon"}, "final01"),
        ({"resource_string": "time_limit: 60"}, load_trial(text="time_limit: 60").name),
    ):
        services = Services(can_load=True)
        assert {40, 41, 43} < services.features
        assert services("LoadWorld", **request)["world"]["name"] == name
        assert [trial.name for trial in services.loaded] == [name]
        assert services("GetSimulationState")["state"]["state"] == 5
        assert services.code("LoadWorld", uri="lesson")[0] == INCORRECT_STATE
        assert services.code("SetSimulationState", state={"state": 2})[0] == INCORRECT_TRANSITION


@pytest.mark.parametrize(
    ("request_", "code", "reason"),
    [
        ({}, 102, "either uri"),
        ({"uri": "lessen"}, NOT_FOUND, "did you mean lesson"),
        ({"uri": "lessen", "resource_string": "time_limit: 60"}, NOT_FOUND, "did you mean lesson"),
        ({"uri": "/etc/hostname"}, NOT_FOUND, "unknown trial"),
        ({"resource_string": "time_limit: soon"}, 103, "time_limit"),
        ({"resource_string": "{"}, 103, "1:"),
        ({"resource_string": "a: 1\n" * 560_000}, 103, "more than 512 KiB of text"),
        ({"world_resource": {"resource_string": "a: 1\n" * 560_000}}, 103, "more than 512 KiB of text"),
    ],
)
def test_wrong_world_is_refused(request_: dict[str, str], code: int, reason: str) -> None:
    services = Services(can_load=True)
    found, message = services.code("LoadWorld", **request_)
    assert (found, services.loaded) == (code, [])
    assert reason in message


def test_session_that_cannot_load_says_so(shared: Services) -> None:
    for name in ("LoadWorld", "UnloadWorld"):
        found, message = shared.code(name, uri="final01")
        assert found == UNSUPPORTED
        assert message == NO_LOADING


def test_unloaded_world_stands_and_offers_nothing_until_another_is_loaded() -> None:
    services = Services(can_load=True)
    services.cell.step()
    assert services.code("UnloadWorld")[0] == OK
    assert (services.state, services.cell.simulation.now) == (NO_WORLD, 0)
    assert not services.rate.take()
    assert services.code("UnloadWorld")[0] == NO_WORLD_LOADED
    assert services.code("GetCurrentWorld") == (NO_WORLD_LOADED, UNLOADED)
    for name in ("GetEntities", "GetNamedPoses", "ResetSimulation", "StepSimulation"):
        assert services.code(name)[0] == INCORRECT_STATE, name
    assert services.code("SetSimulationState", state={"state": PLAYING})[0] == INCORRECT_TRANSITION
    assert not services.rate.take()
    assert not services.features & {25, 26, 31, 32, 33}
    assert services("LoadWorld", uri="final01")["world"]["name"] == "final01"
    assert services.state == LOADING


def test_worlds_name_no_path_of_this_machine(shared: Services) -> None:
    assert str(Path.cwd()) not in str(shared("GetCurrentWorld")) + str(shared("GetAvailableWorlds"))
