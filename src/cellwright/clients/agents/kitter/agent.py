"""Kitter agent: builds the ordered kits of a trial, and sends them."""

import logging
from collections.abc import Sequence
from dataclasses import replace

from cellwright.clients.agents.kitter.arm import JOINT_STATES_TIMEOUT, KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.clearance import ARMS_APART, Clearance
from cellwright.clients.agents.kitter.crew import Crew, Worker, overview
from cellwright.clients.agents.kitter.described_arm import DescribedArm
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.agents.kitter.postures import Postures
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.agents.kitter.supply import Supply
from cellwright.clients.agents.kitter.ur10_on_rail import Ur10OnRail
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.clients.client import Client
from cellwright.clients.client.arm import ClientArm
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.layout import Layout
from cellwright.util.errors import UsageError

log = logging.getLogger(__name__)


class KitterAgent:
    """Builds the ordered kits from bins and belts, and sends them.

    It knows no place and no arm beforehand: those come from the cell (`Client.layout`, `Client.chains`).
    """

    def run(self, client: Client) -> None:
        """Work until the competition is over."""
        layout = client.layout()
        postures = _postures(client, layout)
        workplaces = [Workplace(layout, each) for each in postures]
        workplace = overview(workplaces)
        catalogue = Catalogue(client.part_types())
        brought = {each: client.material_locations(each) for each in catalogue.types}
        belt_types = {
            name: [each for each, places in brought.items() if name in places]
            for name in (each.belt.name for each in workplace.belts)
        }
        view = CellView(client, catalogue, workplace, belt_types)
        types = sorted({each for some in belt_types.values() for each in some})
        workers = []
        for index, (own, arm) in enumerate(zip(workplaces, layout.arms, strict=True)):
            clearance = _clearance(client, layout, postures, index)
            kitter = KitterArm(client, _device(client, arm), postures[index], clearance, own.highest)
            hand = Manipulator(client, kitter, catalogue, own)
            workers.append(Worker(own, kitter, hand, Supply(client, view, kitter, hand, types)))
        crew = Crew(workers)
        client.start_competition()
        client.sleep(0.02)
        if not workplace.stations:
            log.warning("the cell has no AGV and no fixed tray: there is nothing to build a kit on")
            return
        Strategy(client, view, crew, catalogue).run()


def _postures(client: Client, layout: Layout) -> list[Postures]:
    """Return those of each arm of the cell."""
    if not layout.arms:
        raise UsageError("the cell has no arm; give it one in its section cell: arms, or leave the agent out")
    for arm in layout.arms:
        if arm.tool.kind != "vacuum":
            fault = f"{arm.name}: tool: {arm.tool.kind}"
            raise UsageError(f"kitter works with a suction cup ({fault}); write an agent for it")
        if arm.mount.on is not None:
            fault = f"{arm.name} is on {arm.mount.on.carrier}"
            raise UsageError(f"kitter works with arms that stand by themselves ({fault}); write an agent for it")
    first, *others = layout.arms
    # the frame of the UR10 on its rail is its own, and several arms need one frame
    if first.is_original and not others:
        return [Ur10OnRail(first)]
    surfaces = [each.surface for each in (*layout.bins, *layout.belts, *layout.stations)]
    chains, made = client.chains(), []
    for arm in layout.arms:
        device = _device(client, arm)
        device.joint_states.wait_for_next(JOINT_STATES_TIMEOUT)
        home = [device.joint_positions[joint.name] for joint in chains[arm.name].joints]
        made.append(DescribedArm(chains[arm.name], arm, home, max(surfaces, default=0.0)))
    for each, arm in zip(made, layout.arms, strict=True):
        # arms on one rail have beams in one place
        same = (other for other, its in zip(made, layout.arms, strict=True) if its.pose == arm.pose)
        each.figures = replace(each.figures, carriers=frozenset().union(*(other.figures.carriers for other in same)))
    return [*made]


def _device(client: Client, arm: Arm) -> ClientArm:
    """Return topics and services of an arm."""
    return client.arm(arm.namespace) if arm.namespace else client


def _clearance(client: Client, layout: Layout, postures: Sequence[Postures], index: int) -> Clearance | None:
    """Return the distances of an arm of the cell; None without one."""
    chains = client.chains()
    found = [(chains[arm.name], each) for arm, each in zip(layout.arms, postures, strict=True) if arm.name in chains]
    if not found:
        return None
    own, its = found.pop(index)
    return Clearance(client.solids(), own, its, found, max(ARMS_APART, layout.arm_clearance or 0.0))
