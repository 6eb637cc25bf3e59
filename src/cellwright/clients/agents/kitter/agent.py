"""Kitter agent: builds the ordered kits of a trial, and sends them."""

from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.clearance import Clearance
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.client import Client


class KitterAgent:
    """Builds the ordered kits from bins and belt, and sends them."""

    def run(self, client: Client) -> None:
        """Work until the competition is over."""
        catalogue, solids = Catalogue(client.part_types()), client.solids()
        belt_types = [each for each in catalogue.types if "belt" in client.material_locations(each)]
        view = CellView(client, catalogue, belt_types)
        # With the world alone there is no arm.
        arm = KitterArm(client, Clearance(solids) if len(solids) > 1 else None)
        client.start_competition()
        client.sleep(0.02)
        Strategy(client, view, arm, Manipulator(client, arm, catalogue), catalogue, belt_types).run()
