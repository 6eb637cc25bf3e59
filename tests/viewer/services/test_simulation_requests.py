"""Requests of `simulation_interfaces`: their numbers, and answers to nonsense."""

from __future__ import annotations

from cellwright.middleware.bus import PendingResponse
from cellwright.viewer.services.simulation_requests import FAILED, OK
from tests.viewer.services.simulated import GEAR, Services


def test_categories_have_the_numbers_of_the_standard() -> None:
    services = Services()

    def of_category(number: int) -> set[str]:
        return set(services("GetEntities", filters={"categories": [{"category": number}]})["entities"])

    assert {name[-16:] for name in of_category(4)} == {"kit_tray_1::tray", "kit_tray_2::tray"}
    assert {"bin1", "conveyor_belt"} < of_category(5)
    assert not of_category(3)
    for number in (0, 1, 2, 4, 5):
        assert services.code("SetEntityInfo", entity=GEAR, info={"category": {"category": number}})[0] == OK
        assert services("GetEntityInfo", entity=GEAR)["info"]["category"] == {"category": number}
    assert services.code("SetEntityInfo", entity=GEAR, info={"category": {"category": 3}}) == (
        FAILED,
        "category must be one of 0, 1, 2, 4, 5 (got 3)",
    )


def test_each_service_answers_an_empty_request_with_a_code() -> None:
    services = Services(can_load=True)
    services.rate.pause()
    for name in sorted(services.handlers.keys() - {"UnloadWorld", "GetSimulatorFeatures"}):
        found = services(name)
        if isinstance(found, PendingResponse):
            services.cell.step()
            found = found.response
        assert found["result"]["result"] in {*range(5), *range(101, 110)}, name
    services.cell.step()
