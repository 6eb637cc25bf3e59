"""Competition in the cell: belts and populations carry out the referee's decisions, trays and gripper report to it.

It joins the kitting logic, which knows no physics, with the devices, which know no orders.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

from cellwright.cell.devices.conveyor import Conveyor, Population
from cellwright.cell.devices.grippers import Gripper
from cellwright.cell.devices.kit_sender import KitSender
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.parts import Parts
from cellwright.cell.kitting import effects as game_effects
from cellwright.cell.kitting.evidence import Evidence, evidence
from cellwright.cell.kitting.fates import Fate, HandlingRecord, PartSnapshot
from cellwright.cell.kitting.inventory import DropZones, TrayObject, part_type, trimmed_name
from cellwright.cell.kitting.kit_score import KitScore, Verdict
from cellwright.cell.kitting.referee import Referee
from cellwright.cell.kitting.scorer import GameScore
from cellwright.cell.model.clones import clone_name
from cellwright.config.trial.trial import Order, Trial
from cellwright.engine.clock import NEVER
from cellwright.engine.device import Device, State
from cellwright.util.errors import RejectedCommandError
from cellwright.util.pose import Pose, Vector3

_AFTER_DEVICES = 10
"""Priority of the referee among the events of a tick: it judges what the devices have done."""


class Competition(Device):
    """Device that runs a trial: announces its orders, has kits judged and ends the game.

    The callbacks in `on_effect` receive every effect of the referee, in order.
    """

    def __init__(
        self,
        trial: Trial,
        *,
        parts: Parts,
        conveyors: Iterable[Conveyor],
        populations: Iterable[Population],
        senders: Iterable[KitSender],
        grippers: Iterable[Gripper],
    ) -> None:
        super().__init__("competition")
        self.trial = trial
        self.referee = Referee(trial)
        self._faulty = frozenset(trial.faulty_parts)
        self.drops = DropZones(trial.drop_regions)
        self.announced: list[Order] = []
        self.on_effect: list[Callable[[game_effects.Effect], None]] = []
        self._handling = HandlingRecord()
        self._dropped_at: Vector3 | None = None
        self._parts = parts
        self._conveyors = tuple(conveyors)
        self._populations = tuple(populations)
        self._senders = tuple(senders)
        self._trays = tuple(each.tray for each in self._senders)
        self._grippers = tuple(grippers)
        self._held: dict[str, str | None] = {}
        """Part that each gripper holds, by the gripper's name: as of its last change."""
        self._fallen_below = min((each.surface for each in trial.layout.belts), default=0.0) / 2
        parts.on_removed.append(lambda part, cause: self._handling.remove(part.name, cause))
        for tray in self._trays:
            tray.on_report.append(self._take_report)
        for sender in self._senders:
            sender.on_submit.append(self._take_kit)
        for gripper in self._grippers:
            gripper.on_change.append(self._take_grip)
            gripper.drop_target = self._drop_target

    @property
    def state(self) -> game_effects.CompetitionState:
        """State of the competition."""
        return self.referee.state

    @property
    def is_timed_out(self) -> bool:
        """True if the time limit ended the game."""
        return self.referee.end_reason is game_effects.EndReason.TIME_LIMIT

    def score(self) -> GameScore:
        """Return the score at this moment."""
        return self.referee.score(self.simulation.now)

    @property
    def process_time(self) -> int:
        """Time from the start to the end of the game, or until now [ns]."""
        return self.referee.process_time(self.simulation.now)

    def evidence(self) -> Evidence:
        """Return the score at this moment, with the evidence for each point earned or lost."""
        trays = {each.tray.link: self.tray_objects(each.tray) for each in self._senders if each.holds_unsent_kit}
        return evidence(self.trial, self.score(), self.process_time, fates=self.fates(), trays=trays, sent=self.sent)

    @property
    def sent(self) -> dict[str, str]:
        """Kit types that AGVs have been sent with, or fixed trays, and not submitted yet, by the tray's link."""
        return {each.tray.link: each.kit_type for each in self._senders if each.state == "preparing_to_deliver"}

    def fates(self) -> dict[str, tuple[Fate | None, ...]]:
        """Return the fates of the parts that judged kits lack, by kit type, for each ordered part."""
        return {kit.kit_type: self._handling.fates(kit.kit_type) for order in self.trial.orders for kit in order.kits}

    def tray_objects(self, tray: KitTray) -> tuple[TrayObject, ...]:
        """Return the last report of a tray as the referee sees it, with types and faults."""
        return tuple(
            TrayObject(each.name, part_type(each.name), self._is_faulty(each.name), each.pose) for each in tray.contents
        )

    def start(self) -> None:
        """Start the competition with the next step. See `Referee.start`."""
        self._carry_out(self.referee.start(self.simulation.now))

    def end(self) -> None:
        """End the competition."""
        self._carry_out(self.referee.end(self.simulation.now))

    def submit(self, tray_id: str, kit_type: str) -> game_effects.KitSubmitted:
        """Have a tray judged as a kit; see `Referee.submit`."""
        submitted = self.referee.submit(tray_id, kit_type, self.simulation.now)
        submitted = replace(submitted, fates=self._fates_of(submitted))
        self._carry_out((submitted,))
        return submitted

    def reset(self) -> None:
        """Begin a new run: nothing announced, every tray empty."""
        self.referee.reset()
        self.drops.reset()
        self.announced, self._held = [], {}
        self.set_record({})
        for tray in self._trays:
            self.referee.tray_changed(tray.link, ())

    def handle_step(self) -> None:
        """Run the referee's next step, which is due."""
        self._carry_out(self.referee.update(self.simulation.now))

    def get_state(self) -> dict[str, Any]:
        """Return the state of referee and drop regions."""
        return {
            "referee": self.referee.get_state(),
            "drops": self.drops.get_state(),
            "announced": [each.order_id for each in self.announced],
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        self.referee.set_state(state["referee"])
        self.drops.set_state(state["drops"])
        self.announced = [order for name in state["announced"] for order in self.trial.orders if order.order_id == name]
        self._held = {each.name: each.part for each in self._grippers}

    def get_record(self) -> State:
        """Return how the parts were handled, and the fates of those that judged kits lack."""
        return self._handling.get_record()

    def set_record(self, record: State) -> None:
        """Restore what `get_record` returned."""
        self._handling.set_record(record)

    def _carry_out(self, effects: tuple[game_effects.Effect, ...]) -> None:
        for effect in effects:
            match effect:
                case game_effects.ConveyorPower(power):
                    for conveyor in self._conveyors:
                        conveyor.set_power(power)
                case game_effects.PopulationRestart():
                    for population in self._populations:
                        population.control("restart")
                case game_effects.OrderAnnounced(order):
                    self.announced.append(order)
                case _:
                    pass
            for listener in self.on_effect:
                listener(effect)
        self._plan()

    def _plan(self) -> None:
        simulation = self.simulation
        simulation.cancel(self, "step")
        deadline = self.referee.next_deadline
        if deadline < NEVER:
            simulation.schedule(self, "step", at=max(deadline, simulation.now), priority=_AFTER_DEVICES)

    def _take_report(self, tray: KitTray) -> None:
        self.referee.tray_changed(tray.link, self.tray_objects(tray))
        self._handling.report(tray.link, (each.name for each in tray.contents))
        self._plan()

    def _take_kit(self, sender: KitSender, kit_type: str) -> None:
        try:
            self.submit(sender.tray.link, kit_type)
        except RejectedCommandError:
            # the AGV drives off with its kit all the same, as in the original
            return

    def _take_grip(self, gripper: Gripper) -> None:
        now = self.simulation.now
        enabled = [each for each in self._grippers if each.enabled]
        attached = any(each.attached for each in enabled)
        self.referee.scorer.gripper_changed(now, enabled=bool(enabled), attached=attached)
        held, self._held[gripper.name] = self._held.get(gripper.name), gripper.part
        # a part that one gripper hands to another is in both for a while
        if held is not None and held != gripper.part and held not in self._held.values():
            forced_at, self._dropped_at = self._dropped_at, None
            position = forced_at or self._parts.pose(self._parts.part(held)).position
            self._handling.let_go(held, position, now, is_forced=forced_at is not None)
        if gripper.part is not None and held != gripper.part and not self._handling.is_held(gripper.part):
            self._handling.take(gripper.part, now)

    def _fates_of(self, submitted: game_effects.KitSubmitted) -> tuple[Fate | None, ...]:
        """Return the fates of the parts that a judged kit lacks; for a kit judged before, the fates found then."""
        score = submitted.score
        if submitted.is_repeated or not score.is_submitted:
            return self._handling.fates(score.kit_type) if score.is_submitted else ()
        reported = [each.name for each in self.referee.trays[submitted.tray_id]]
        now = self.simulation.now
        return self._handling.judge(score, submitted.tray_id, reported, self._parts_now(score), now)

    def _parts_now(self, score: KitScore) -> Iterator[PartSnapshot]:
        """Yield the parts of the types that a kit lacks, where they are now."""
        missing = {finding.type for finding in score.parts if finding.verdict is Verdict.MISSING}
        if not missing:
            return
        trays = {each.name: tray.link for tray in self._trays for each in tray.find_parts()}
        for name in self._parts.names:
            if (kind := part_type(name)) not in missing:
                continue
            position, above = None, ""
            if name in self._parts.in_play:
                position = self._parts.pose(self._parts.part(name)).position
                above = next((tray.link for tray in self._trays if tray.is_below(position)), "")
            has_fallen = position is not None and name.startswith(clone_name("")) and position[2] < self._fallen_below
            yield PartSnapshot(name, kind, position, trays.get(name, ""), above, self._is_faulty(name), has_fallen)

    def _is_faulty(self, model_name: str) -> bool:
        return trimmed_name(model_name) in self._faulty

    def _drop_target(self, name: str, world_T_part: Pose) -> Pose | None:
        region = self.drops.drop(part_type(name), world_T_part.position)
        self._dropped_at = None if region is None else world_T_part.position
        return None if region is None else region.destination


def is_done(effect: game_effects.Effect) -> bool:
    """Return whether this is the end: the competition is done."""
    return isinstance(effect, game_effects.StateChanged) and effect.state is game_effects.CompetitionState.DONE
