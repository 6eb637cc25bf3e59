"""Kitter agent: builds the ordered kits of a trial, and sends them."""

import logging
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeAlias

from cellwright.clients.agents.kitter.agreement import Agreement
from cellwright.clients.agents.kitter.arm import JOINT_STATES_TIMEOUT, KitterArm
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.clearance import ARMS_APART, Clearance, below_cup
from cellwright.clients.agents.kitter.crew import Worker, share_out
from cellwright.clients.agents.kitter.crew_arm import CrewArm
from cellwright.clients.agents.kitter.described_arm import DescribedArm
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Manipulator
from cellwright.clients.agents.kitter.postures import Postures
from cellwright.clients.agents.kitter.regions import Lane, Regions
from cellwright.clients.agents.kitter.strategy import Strategy
from cellwright.clients.agents.kitter.supply import Supply
from cellwright.clients.agents.kitter.turns import Turns
from cellwright.clients.agents.kitter.ur10_on_rail import Ur10OnRail
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.clients.client import Client
from cellwright.clients.client.arm import ClientArm
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.layout import Layout
from cellwright.util.errors import UsageError

LEVEL_HAND = 0.003
"""Distance [m] by which something of the hand may reach below the cup: the cup is pressed deeper into a part."""

log = logging.getLogger(__name__)

_MakeHand: TypeAlias = Callable[[Client, KitterArm, Catalogue, Workplace], Manipulator]


class KitterAgent:
    """Builds the ordered kits from bins and belts, and sends them.

    It knows no place and no arm beforehand: those come from the cell (`Client.layout`, `Client.chains`).
    """

    def run(self, client: Client) -> None:
        """Work until the competition is over."""
        crew = _Crew(client, self.hand)
        if crew.size == 1:
            work = crew.prepare(client, 0)
            if crew.start(client):
                work()
            return
        turns = Turns(client.transport, crew.size)
        try:
            works = turns.run([partial(crew.prepare, own, index) for index, own in enumerate(turns.clients)])
            if crew.start(client):
                turns.run(works)
        finally:
            turns.close()

    def hand(self, client: Client, arm: KitterArm, catalogue: Catalogue, places: Workplace) -> Manipulator:
        """Return what picks and places with an arm; a subclass may return one with other habits."""
        return Manipulator(client, arm, catalogue, places)


class _Crew:
    """The arms of a cell, as a client has it."""

    def __init__(self, client: Client, make_hand: _MakeHand) -> None:
        self._make_hand = make_hand
        self._layout = layout = client.layout()
        self._postures = postures = _postures(client, layout)
        self._workplaces = share_out([Workplace(layout, each) for each in postures])
        self._agreement = Agreement([[each.location for each in own.stations.values()] for own in self._workplaces])
        self.size = len(postures)
        chains = client.chains()
        arms = [(chains[arm.name], each) for arm, each in zip(layout.arms, postures, strict=True) if arm.name in chains]
        self._arms = arms
        self._regions = Regions(client.solids(), arms, self._apart) if self.size > 1 else None

    @property
    def _apart(self) -> float:
        """Least distance between arms [m]."""
        return max(ARMS_APART, self._layout.arm_clearance or 0.0)

    def prepare(self, client: Client, index: int) -> Callable[[], None]:
        """Look around, and return the work of an arm.

        Raises:
            UsageError: the arm stands too near to another one.
        """
        places = self._workplaces[index]
        catalogue = Catalogue(client.part_types())
        brought = {each: client.material_locations(each) for each in catalogue.types}
        belt_types = {
            name: [each for each, locations in brought.items() if name in locations]
            for name in (each.belt.name for each in places.belts)
        }
        view = CellView(client, catalogue, places, belt_types)
        arm = self._arm(client, index)
        fault = arm.fault_at_home() if isinstance(arm, CrewArm) else None
        if fault is not None:
            raise UsageError(f"at home {fault}; give the arms other homes in the cell's section arms: home")
        hand = self._make_hand(client, arm, catalogue, places)
        share = self._agreement.share(index)
        types = sorted({each for some in belt_types.values() for each in some})
        supply = Supply(client, view, arm, hand, share, types)
        title = f"{self._layout.arms[index].name}: " if self.size > 1 else ""
        worker = Worker(places, arm, hand, supply, share, title)
        return lambda: Strategy(client, view, worker, catalogue).run()

    def start(self, client: Client) -> bool:
        """Start the competition; False if there is nothing to build a kit on."""
        client.start_competition()
        client.sleep(0.02)
        if not any(each.stations for each in self._workplaces):
            log.warning("the cell has no AGV and no fixed tray: there is nothing to build a kit on")
            return False
        return True

    def _arm(self, client: Client, index: int) -> KitterArm:
        device, postures = _device(client, self._layout.arms[index]), self._postures[index]
        highest = self._workplaces[index].highest
        clearance = None
        if self._arms:
            others = [each for number, each in enumerate(self._arms) if number != index]
            clearance = Clearance(client.solids(), *self._arms[index], others, self._apart)
        if self._regions is None or clearance is None:
            return KitterArm(client, device, postures, clearance, highest)
        return CrewArm(client, device, postures, clearance, highest, Lane(self._regions, index))


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
    chains, solids, made = client.chains(), client.solids(), []
    for arm in layout.arms:
        device = _device(client, arm)
        device.joint_states.wait_for_next(JOINT_STATES_TIMEOUT)
        home = [device.joint_positions[joint.name] for joint in chains[arm.name].joints]
        made.append(DescribedArm(chains[arm.name], arm, home, max(surfaces, default=0.0)))
        _check_hand(arm, *below_cup(solids, chains[arm.name], made[-1].figures.gripper))
    for each, arm in zip(made, layout.arms, strict=True):
        # arms on one rail have beams in one place
        same = (other for other, its in zip(made, layout.arms, strict=True) if its.pose == arm.pose)
        each.figures = replace(each.figures, carriers=frozenset().union(*(other.figures.carriers for other in same)))
    return [*made]


def _check_hand(arm: Arm, depth: float, link: str) -> None:
    """Refuse an arm with something of the hand below its cup: it would touch what lies around a part."""
    if depth > LEVEL_HAND:
        least = math.ceil((arm.tool.length + depth) * 1e3) / 1e3
        raise UsageError(
            f"{arm.name}: {link} reaches {depth * 1e3:.0f} mm below the suction cup, and would touch what it is to "
            f"grip; put the cup below by tool: {{kind: vacuum, length: {least:g}}}, or take the link out of the model"
        )


def _device(client: Client, arm: Arm) -> ClientArm:
    """Return topics and services of an arm."""
    return client.arm(arm.namespace) if arm.namespace else client
