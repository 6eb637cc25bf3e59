"""The competition on the floor: the referee's word carried out by belt and population, its eyes on trays and gripper.

It joins the kitting logic, which knows no physics, with the devices, which know no orders.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from cellwright.description.trial import Order, Trial
from cellwright.devices.agv import Agv
from cellwright.devices.conveyor import Conveyor
from cellwright.devices.gripper.vacuum_gripper import VacuumGripper
from cellwright.devices.kit_tray import KitTray
from cellwright.devices.population import Population
from cellwright.errors import RejectedCommandError
from cellwright.kitting.drops import DropZones
from cellwright.kitting.effects import (
    CompetitionState,
    ConveyorPower,
    Effect,
    EndReason,
    KitSubmitted,
    OrderAnnounced,
    PopulationRestart,
    StateChanged,
)
from cellwright.kitting.faults import Faults
from cellwright.kitting.names import part_type
from cellwright.kitting.referee import Referee
from cellwright.kitting.score.evidence import Evidence, evidence
from cellwright.kitting.score.scorer import GameScore
from cellwright.kitting.tray import TrayObject
from cellwright.pose import Pose
from cellwright.simulation.device import Device, State
from cellwright.simulation.events import NEVER

_AFTER_DEVICES = 10
"""Priority of the referee among the events of a tick: it judges what the devices have done."""


class Competition(Device):
    """Runs a trial: announces its orders, has kits judged and ends the game.

    `on_effect` hears everything that the referee does, in order.
    """

    def __init__(
        self,
        trial: Trial,
        *,
        conveyor: Conveyor,
        population: Population | None,
        trays: Mapping[int, KitTray],
        agvs: Mapping[int, Agv],
        gripper: VacuumGripper | None,
    ) -> None:
        super().__init__("competition")
        self.trial = trial
        self.referee = Referee(trial)
        self.faults = Faults(trial.faulty_parts)
        self.drops = DropZones(trial.drop_regions)
        self.announced: list[Order] = []
        self.on_effect: list[Callable[[Effect], None]] = []
        self._conveyor = conveyor
        self._population = population
        self._trays = dict(trays)
        self._gripper = gripper
        for tray in trays.values():
            tray.on_report.append(self._take_report)
        for agv in agvs.values():
            agv.on_submit.append(self._take_kit)
        if gripper is not None:
            gripper.on_change.append(self._take_grip)
            gripper.drop_target = self._drop_target

    # ---------------------------------------------------------------- what one may ask

    @property
    def state(self) -> CompetitionState:
        """The state of the competition."""
        return self.referee.state

    @property
    def is_timed_out(self) -> bool:
        """Whether the time limit ended the game."""
        return self.referee.end_reason is EndReason.TIME_LIMIT

    def score(self) -> GameScore:
        """The score at this moment."""
        return self.referee.score(self.simulation.now)

    @property
    def process_time(self) -> int:
        """From the start to the end of the game, or until now [ns]."""
        return self.referee.process_time(self.simulation.now)

    def evidence(self) -> Evidence:
        """The score at this moment, with what earned or lost each point."""
        return evidence(self.trial, self.score(), self.process_time)

    def tray_objects(self, tray: KitTray) -> tuple[TrayObject, ...]:
        """What a tray last reported, with types and faults, as the referee sees it."""
        return tuple(
            TrayObject(each.name, part_type(each.name), self.faults.is_faulty(each.name), each.pose)
            for each in tray.contents
        )

    # ---------------------------------------------------------------- commands

    def start(self) -> None:
        """Start the competition; it goes with the next step.

        Raises:
            RejectedCommandError: it was started before.
        """
        self._carry_out(self.referee.start(self.simulation.now))

    def end(self) -> None:
        """End the competition."""
        self._carry_out(self.referee.end(self.simulation.now))

    def submit(self, tray_id: str, kit_type: str) -> KitSubmitted:
        """Have a tray judged as a kit.

        Raises:
            RejectedCommandError: the competition is not running.
            UnknownNameError: there is no such tray.
        """
        submitted = self.referee.submit(tray_id, kit_type, self.simulation.now)
        self._carry_out((submitted,))
        return submitted

    # ---------------------------------------------------------------- life

    def reset(self) -> None:
        """A new run: nothing announced, every tray empty."""
        self.referee.reset()
        self.drops.reset()
        self.announced = []
        for tray in self._trays.values():
            self.referee.tray_changed(tray.link, ())

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """The referee's next step is due."""
        if kind != "step":
            super().handle(kind, arguments)
        self._carry_out(self.referee.update(self.simulation.now))

    def get_state(self) -> dict[str, Any]:
        """What referee and drop regions remember."""
        return {
            "referee": self.referee.get_state(),
            "drops": self.drops.get_state(),
            "announced": [each.order_id for each in self.announced],
        }

    def set_state(self, state: State) -> None:
        """Remember what `get_state` returned."""
        self.referee.set_state(state["referee"])
        self.drops.set_state(state["drops"])
        self.announced = [order for name in state["announced"] for order in self.trial.orders if order.order_id == name]

    # ---------------------------------------------------------------- inside

    def _carry_out(self, effects: tuple[Effect, ...]) -> None:
        for effect in effects:
            match effect:
                case ConveyorPower(power):
                    self._conveyor.set_power(power)
                case PopulationRestart():
                    if self._population is not None:
                        self._population.control("restart")
                case OrderAnnounced(order):
                    self.announced.append(order)
                case _:
                    pass
            for listener in self.on_effect:
                listener(effect)
        self._plan()

    def _plan(self) -> None:
        simulation = self.simulation
        simulation.cancel(self, "step")
        deadline = self.referee.next_deadline()
        if deadline < NEVER:
            simulation.schedule(self, "step", at=max(deadline, simulation.now), priority=_AFTER_DEVICES)

    def _take_report(self, tray: KitTray) -> None:
        self.referee.tray_changed(tray.link, self.tray_objects(tray))
        self._plan()

    def _take_kit(self, agv: Agv, kit_type: str) -> None:
        try:
            self.submit(agv.tray.link, kit_type)
        except RejectedCommandError:
            return  # the AGV drives off with its kit all the same, as in the original

    def _take_grip(self, gripper: VacuumGripper) -> None:
        self.referee.gripper_changed(self.simulation.now, enabled=gripper.enabled, attached=gripper.attached)

    def _drop_target(self, name: str, world_T_part: Pose) -> Pose | None:
        region = self.drops.drop(part_type(name), world_T_part.position)
        return None if region is None else region.destination


def is_done(effect: Effect) -> bool:
    """Whether this is the end: the competition is done."""
    return isinstance(effect, StateChanged) and effect.state is CompetitionState.DONE
