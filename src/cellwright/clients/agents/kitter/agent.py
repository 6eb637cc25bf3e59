"""The agent itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cellwright.clients.agents.kitter.arm import Arm
from cellwright.clients.agents.kitter.cellview import CellView
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.picking import Picker
from cellwright.clients.agents.kitter.placing import Placer
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.client import Client
from cellwright.util.errors import CellwrightError


class KitterAgent:
    """Builds the kits that are ordered, from bins and belt, and sends them off."""

    def run(self, client: Client) -> None:
        """Work until the competition is over."""
        catalogue = Catalogue(own_types(client))
        belt_types = [each for each in catalogue.types if "belt" in client.material_locations(each)]
        view = CellView(client, catalogue, belt_types)
        arm = Arm(client)
        view.agvs.listen()
        client.start_competition()
        client.sleep(0.02)
        Strategy(client, view, arm, Picker(client, arm, catalogue), Placer(client, arm), catalogue).run()


def own_types(client: Client) -> Mapping[str, Mapping[str, Any]]:
    """The part types of the trial's own; none where the cell does not tell them."""
    try:
        return client.part_types()
    except CellwrightError:  # a cell of an earlier version
        return {}
