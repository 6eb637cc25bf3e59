"""Kitter agent: builds the ordered kits of a trial, and sends them."""

import logging

from cellwright.clients.agents.kitter.arm import JOINT_STATES_TIMEOUT, KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.clearance import Clearance
from cellwright.clients.agents.kitter.described_arm import DescribedArm
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.agents.kitter.postures import Postures
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.agents.kitter.ur10_on_rail import Ur10OnRail
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.clients.client import Client
from cellwright.clients.client.arm import ClientArm
from cellwright.config.layout.layout import Layout
from cellwright.util.errors import UsageError

log = logging.getLogger(__name__)


class KitterAgent:
    """Builds the ordered kits from bins and belts, and sends them.

    It knows no place beforehand: those of bins, belts, trays and the arm come from the cell (`Client.layout`).
    """

    def run(self, client: Client) -> None:
        """Work until the competition is over."""
        layout = client.layout()
        postures = _postures(client, layout)
        workplace = Workplace(layout, postures)
        catalogue = Catalogue(client.part_types())
        brought = {each: client.material_locations(each) for each in catalogue.types}
        belt_types = {
            name: [each for each, places in brought.items() if name in places]
            for name in (each.belt.name for each in workplace.belts)
        }
        view = CellView(client, catalogue, workplace, belt_types)
        arm = KitterArm(
            client, _device(client, layout), postures, _clearance(client, layout, postures), workplace.highest
        )
        hand = Manipulator(client, arm, catalogue, workplace)
        client.start_competition()
        client.sleep(0.02)
        if not workplace.stations:
            log.warning("the cell has no AGV and no fixed tray: there is nothing to build a kit on")
            return
        Strategy(
            client, view, arm, hand, catalogue, sorted({each for some in belt_types.values() for each in some})
        ).run()


def _postures(client: Client, layout: Layout) -> Postures:
    """Return those of the cell's arm."""
    if not layout.arms:
        raise UsageError("the cell has no arm; give it one in its section cell: arms, or leave the agent out")
    arm, *others = layout.arms
    if others:
        raise UsageError(f"kitter works with one arm (the cell has {1 + len(others)}); write an agent, with Client.arm")
    if arm.is_original:
        return Ur10OnRail(arm)
    if arm.tool.kind != "vacuum":
        raise UsageError(f"kitter works with a suction cup ({arm.name}: tool: {arm.tool.kind}); write an agent for it")
    chain = client.chains()[arm.name]
    device = _device(client, layout)
    device.joint_states.wait_for_next(JOINT_STATES_TIMEOUT)
    home = [device.joint_positions[joint.name] for joint in chain.joints]
    surfaces = [each.surface for each in (*layout.bins, *layout.belts, *layout.stations)]
    return DescribedArm(chain, arm, home, max(surfaces, default=0.0))


def _device(client: Client, layout: Layout) -> ClientArm:
    """Return topics and services of the cell's arm."""
    namespace = layout.arms[0].namespace
    return client.arm(namespace) if namespace else client


def _clearance(client: Client, layout: Layout, postures: Postures) -> Clearance | None:
    """Return the distances of the cell's arm; None without one."""
    chain = client.chains().get(layout.arms[0].name)
    return None if chain is None else Clearance(client.solids(), chain, postures)
