"""What happened when in a run: orders, kits, gripper and AGVs, gathered while it goes on."""

from __future__ import annotations

from typing import Any

from cellwright.cell.cell import Cell
from cellwright.cell.devices.gripper.vacuum_gripper import VacuumGripper
from cellwright.cell.kitting.effects import Effect, KitSubmitted, OrderAnnounced, OrderCompleted
from cellwright.cell.kitting.names import part_type


class Timeline:
    """Looks on at a cell in one run; it leaves the run as it is.

    `look` is to be called some ten times a simulated second: the states of the AGVs are read there.
    """

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._orders: dict[str, dict[str, Any]] = {}
        self._kits: list[dict[str, Any]] = []
        self._held: list[dict[str, Any]] = []
        self._agvs: dict[int, list[dict[str, Any]]] = {number: [] for number in cell.agvs}
        cell.competition.on_effect.append(self._take_effect)
        if cell.gripper is not None:
            cell.gripper.on_change.append(self._take_grip)

    def look(self) -> None:
        """Read the states of the AGVs."""
        now = self._cell.simulation.time
        for number, agv in self._cell.agvs.items():
            spans = self._agvs[number]
            if not spans or spans[-1]["state"] != agv.state:
                if spans:
                    spans[-1]["end"] = now
                spans.append({"begin": now, "end": None, "state": agv.state})

    def as_json(self) -> dict[str, Any]:
        """What has happened so far, as JSON values; times in s, `end` None for what goes on."""
        return {
            "end": self._cell.simulation.time,
            "orders": list(self._orders.values()),
            "kits": self._kits,
            "held": self._held,
            "agvs": {str(number): spans for number, spans in self._agvs.items()},
        }

    def _take_effect(self, effect: Effect) -> None:
        now = self._cell.simulation.time
        match effect:
            case OrderAnnounced(order):
                self._orders[order.order_id] = {"order": order.order_id, "announced": now, "completed": None}
            case OrderCompleted(score):
                self._orders[score.order_id]["completed"] = now
            case KitSubmitted(tray, kit_type, score):
                number = tray.partition("::")[0].removeprefix("agv")
                self._kits.append({"time": now, "agv": number, "kit": kit_type, "points": score.total})
            case _:
                pass

    def _take_grip(self, gripper: VacuumGripper) -> None:
        now = self._cell.simulation.time
        if self._held and self._held[-1]["end"] is None:
            if gripper.attached and gripper.part == self._held[-1]["part"]:
                return
            self._held[-1]["end"] = now
        if gripper.attached and gripper.part is not None:
            self._held.append({"begin": now, "end": None, "part": gripper.part, "type": part_type(gripper.part)})
