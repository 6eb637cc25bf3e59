"""Panel of a cell: competition, orders, trays and score, as far as a running competition reveals them.

Each request makes it, and leaves the cell as it is. A competition's secrets stay hidden: orders not yet announced, and
faulty parts that the referee has not named. Values that change all the time are under `clock`, so that the rest changes
only on events.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from cellwright.cell.cell import Cell
from cellwright.cell.devices.finger_gripper import FingerGripper
from cellwright.cell.devices.kit_sender import FixedTray, KitSender
from cellwright.cell.kitting.attainable import AttainableScore, attainable_score
from cellwright.cell.kitting.evidence import Evidence, evidence, evidence_to_json, kit_evidence, kit_to_json
from cellwright.cell.kitting.fates import Fate
from cellwright.cell.kitting.inventory import TrayContents
from cellwright.cell.kitting.kit_score import score_kit
from cellwright.cell.kitting.scorer import GameScore
from cellwright.config.trial.trial import Kit, Order, Trial

IN_COMPETITION = "not available in competition mode; use development mode (-d)"
"""Reason why belt, reset and the like are refused."""
OVER = "the run is over"
"""Reason why the controls are refused after the run."""
_RESULT = ("outcome", "error", "simulated", "wall", "state_hash")


def hides_ground_truth(cell: Cell) -> bool:
    """Return whether this is a competition that is not over yet."""
    return cell.in_competition and cell.competition.referee.end_reason is None


def known_orders(cell: Cell) -> list[Order]:
    """Orders that may be known, the announced ones first; no others while ground truth is hidden."""
    announced = cell.competition.announced
    if hides_ground_truth(cell):
        return announced
    return [*announced, *(order for order in cell.trial.orders if order not in announced)]


def without_faults(cell: Cell) -> Trial:
    """The trial. While ground truth is hidden all its parts are good, since what is attainable reveals the faults."""
    return replace(cell.trial, faulty_parts=frozenset()) if hides_ground_truth(cell) else cell.trial


def known_evidence(cell: Cell) -> Evidence:
    """Score with its evidence. While ground truth is hidden it covers announced orders only."""
    if not hides_ground_truth(cell):
        return cell.competition.evidence()
    trial = replace(without_faults(cell), orders=tuple(known_orders(cell)))
    return evidence(trial, cell.competition.score(), cell.competition.process_time, sent=cell.competition.sent)


class CellPanel:
    """Panel of a cell. `about` holds what the caller knows of it, such as the agent's name."""

    def __init__(self, cell: Cell, about: Mapping[str, Any] | None = None) -> None:
        self._cell = cell
        self._about = dict(about or {})
        self.collisions: Callable[[], dict[str, Any] | None] = lambda: None
        """Returns the collisions of the arm, see `run.collisions.CollisionWatch.panel`; None without a watch."""
        self._result: dict[str, Any] | None = None
        # slow to compute, and seldom different
        self._attainable: dict[bool, AttainableScore] = {}
        self._scored: tuple[tuple[object, ...], dict[str, Any]] = (), {}
        self._as_kits: dict[tuple[int, str], tuple[tuple[Kit, TrayContents, AttainableScore], dict[str, Any]]] = {}

    def end(self, result: Mapping[str, Any]) -> None:
        """Show the end of the run from now on, with the keys of `_RESULT`."""
        self._result = {key: result[key] for key in _RESULT}

    def restart(self) -> None:
        """Show the next run of the cell."""
        self._result = None

    def panel(self) -> dict[str, Any]:
        """Return the panel as JSON values; times in s."""
        cell = self._cell
        competition, score = cell.competition, cell.competition.score()
        attainable, intention = self._reach(), cell.intention
        reason = OVER if self._result is not None else IN_COMPETITION if cell.in_competition else ""
        return {
            "kind": "cell",
            "name": cell.name,
            "about": {"seed": cell.seed, "servo": cell.servo, **self._about},
            "development": not cell.in_competition,
            "state": str(competition.state),
            "end_reason": None if competition.referee.end_reason is None else str(competition.referee.end_reason),
            "time_limit": cell.trial.time_limit,
            "clock": self._clock(score),
            "score": self._score(score, attainable),
            "orders": self._orders(),
            "trays": [self._tray(number, attainable) for number in cell.trays],
            "agvs": [_sender(each) for each in cell.agvs.values()],
            "fixed_trays": [_sender(each) for each in cell.senders.values() if isinstance(each, FixedTray)],
            "belts": [self._belt(name) for name in cell.conveyors],
            "grippers": [
                {
                    "name": each.name.replace("_", " "),
                    "enabled": each.enabled,
                    "width": round(each.width, 4) if isinstance(each, FingerGripper) else None,
                    "attached": each.attached,
                    "part": each.part,
                }
                for each in cell.grippers.values()
            ],
            "intention": {"text": intention.text, "node": intention.node, "time": intention.time / 1e9}
            if intention.text
            else None,
            "operator": intention.operator.state,
            "collisions": self.collisions(),
            "refused": {"belt": reason, "clear": reason} if reason else {},
            "result": self._result,
        }

    def _belt(self, name: str) -> dict[str, Any]:
        """Belt with its service, its power [%], and whether parts are being added; None if none ever are."""
        row = "conveyor" if len(self._cell.conveyors) == 1 else f"conveyor_{name}"
        population = self._cell.populations.get(name)
        return {
            "name": name,
            "service": f"/ariac/{row}/control",
            "power": self._cell.conveyors[name].power,
            "population": None if population is None else population.running,
        }

    def _clock(self, score: GameScore) -> dict[str, Any]:
        simulation = self._cell.simulation
        return {
            "time": simulation.time,
            "tick": simulation.clock.tick,
            "process_time": self._cell.competition.process_time / 1e9,
            "part_travel_time": score.part_travel_time / 1e9,
            "orders": {order.order_id: order.time_taken / 1e9 for order in score.orders},
        }

    def _score(self, score: GameScore, attainable: AttainableScore) -> dict[str, Any]:
        """Score with its evidence, without times, and without orders that are still secret."""
        hides, sent = hides_ground_truth(self._cell), self._cell.competition.sent
        fates = {} if hides else self._cell.competition.fates()  # they reveal the faulty parts
        orders = [(order.order_id, order.kits, order.is_complete) for order in score.orders]  # all but their times
        facts = (hides, sent, fates, orders)
        if self._scored[0] != facts:
            self._scored = facts, self._score_of(score, attainable, fates, sent)
        return self._scored[1]

    def _score_of(
        self,
        score: GameScore,
        attainable: AttainableScore,
        fates: Mapping[str, Sequence[Fate | None]],
        sent: Mapping[str, str],
    ) -> dict[str, Any]:
        trial = without_faults(self._cell)
        found = evidence_to_json(evidence(trial, score, attainable=attainable, fates=fates, sent=sent))
        for key in ("process_time", "part_travel_time"):
            del found[key]
        known = {order.order_id for order in known_orders(self._cell)}
        found["orders"] = [order for order in found["orders"] if order["order_id"] in known]
        for order in found["orders"]:
            del order["time_taken"]
        if len(found["orders"]) < len(self._cell.trial.orders):
            # They would reveal orders to come.
            found |= {"reachable": None, "best": None, "reachable_reason": ""}
        return found

    def _reach(self) -> AttainableScore:
        """Points attainable in the trial, as far as they may be known."""
        key = hides_ground_truth(self._cell)
        if key not in self._attainable:
            self._attainable[key] = attainable_score(without_faults(self._cell))
        return self._attainable[key]

    def _orders(self) -> list[dict[str, Any]]:
        competition = self._cell.competition
        return [
            {
                "order_id": order.order_id,
                "status": self._status(order),
                "start_time": order.start_time,
                "kits": [
                    {
                        "kit_type": kit.kit_type,
                        "submitted": competition.referee.scorer.is_submitted(kit.kit_type),
                        "parts": [each.type for each in kit.objects],
                    }
                    for kit in order.kits
                ],
            }
            for order in known_orders(self._cell)
        ]

    def _status(self, order: Order) -> str:
        """Status `to come`, `active`, `interrupted`, `complete`, or `open`: not complete at the end of the run."""
        referee, name = self._cell.competition.referee, order.order_id
        if referee.scorer.is_complete(name):
            return "complete"
        if order not in self._cell.competition.announced:
            return "to come"
        is_over = referee.end_reason is not None or self._result is not None
        if is_over or name not in referee.active_orders:
            return "open"
        return "active" if referee.active_orders[-1] == name else "interrupted"

    def _tray(self, number: int, attainable: AttainableScore) -> dict[str, Any]:
        """Last report of a tray, and its points as each kit of the active orders if it were sent now."""
        contents = self._cell.competition.tray_objects(self._cell.trays[number])
        # Which parts are faulty is a secret until the kit is judged.
        if hides_ground_truth(self._cell):
            contents = tuple(replace(each, is_faulty=False) for each in contents)
        return {
            "number": number,
            "parts": [{"name": each.name, "type": each.type, "faulty": each.is_faulty} for each in contents],
            "as_kits": [self._as_kit(number, kit, contents, attainable) for kit in self._open_kits()],
        }

    def _as_kit(self, number: int, kit: Kit, contents: TrayContents, attainable: AttainableScore) -> dict[str, Any]:
        known, found = self._as_kits.get((number, kit.kit_type), (None, {}))
        if known != (kit, contents, attainable):
            found = kit_to_json(kit_evidence(score_kit(kit, contents), attainable.kit(kit.kit_type)))
            self._as_kits[number, kit.kit_type] = (kit, contents, attainable), found
        return found

    def _open_kits(self) -> list[Kit]:
        referee = self._cell.competition.referee
        if referee.end_reason is not None:
            return []
        return [
            kit
            for order in self._cell.competition.announced
            if order.order_id in referee.active_orders
            for kit in order.kits
            if not referee.scorer.is_submitted(kit.kit_type)
        ]


def _sender(sender: KitSender) -> dict[str, Any]:
    return {"number": sender.number, "name": sender.name, "state": sender.state, "kit_type": sender.kit_type}
