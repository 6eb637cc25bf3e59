"""Kitter agent: builds the ordered kits of a trial, and sends them."""

import logging

from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.clearance import Clearance
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.clients.client import Client

log = logging.getLogger(__name__)


class KitterAgent:
    """Builds the ordered kits from bins and belts, and sends them.

    It knows no place beforehand: those of bins, belts, trays and the arm come from the cell (`Client.layout`).
    """

    def run(self, client: Client) -> None:
        """Work until the competition is over."""
        workplace = Workplace(client.layout())
        catalogue, solids = Catalogue(client.part_types()), client.solids()
        brought = {each: client.material_locations(each) for each in catalogue.types}
        belt_types = {
            name: [each for each, places in brought.items() if name in places]
            for name in (each.belt.name for each in workplace.belts)
        }
        view = CellView(client, catalogue, workplace, belt_types)
        # With the world alone there is no arm.
        clearance = Clearance(solids, workplace.arm_T_world) if len(solids) > 1 else None
        arm = KitterArm(client, clearance, workplace.highest)
        hand = Manipulator(client, arm, catalogue, workplace.drop_places)
        client.start_competition()
        client.sleep(0.02)
        if not workplace.stations:
            log.warning("the cell has no AGV and no fixed tray: there is nothing to build a kit on")
            return
        Strategy(
            client, view, arm, hand, catalogue, sorted({each for some in belt_types.values() for each in some})
        ).run()
