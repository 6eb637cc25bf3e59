"""The agent itself."""

from __future__ import annotations

from cellwright.agents.kitter.arm import Arm
from cellwright.agents.kitter.cellview import CellView
from cellwright.agents.kitter.part_figures import PART_TYPES
from cellwright.agents.kitter.picking import Picker
from cellwright.agents.kitter.placing import Placer
from cellwright.agents.kitter.strategy import Strategy
from cellwright.client import Client


class KitterAgent:
    """Builds the kits that are ordered, from bins and belt, and sends them off."""

    def run(self, client: Client) -> None:
        """Work until the competition is over."""
        belt_types = [each for each in sorted(PART_TYPES) if "belt" in client.material_locations(each)]
        view = CellView(client, belt_types)
        arm = Arm(client)
        view.agvs.listen()
        client.start_competition()
        client.sleep(0.02)
        Strategy(client, view, arm, Picker(client, arm), Placer(client, arm)).run()
