"""Effects of the referee: plain values that the cell carries out, publishes and logs."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias, Union

from cellwright.cell.kitting.fates import Fate
from cellwright.cell.kitting.kit_score import KitScore
from cellwright.cell.kitting.scorer import GameScore, OrderScore
from cellwright.config.trial.trial import Order

Effect: TypeAlias = Union[
    "StateChanged",
    "ConveyorPower",
    "PopulationRestart",
    "OrderAnnounced",
    "KitSubmitted",
    "OrderCompleted",
    "TrialEnded",
]


class CompetitionState(StrEnum):
    """States of a competition, as published on its topic."""

    INIT = "init"
    READY = "ready"
    GO = "go"
    END_GAME = "end_game"
    DONE = "done"


class AnnouncementReason(StrEnum):
    """Reasons for announcing an order."""

    TIME = "time"
    IDLE = "no order in progress"
    WANTED_PARTS = "wanted parts on a tray"
    UNWANTED_PARTS = "unwanted parts on a tray"


class EndReason(StrEnum):
    """Reasons for the end of a trial."""

    ORDERS_COMPLETE = "all orders complete"
    NO_ORDERS = "no orders"
    TIME_LIMIT = "time limit"
    COMMAND = "ended by command"


@dataclass(frozen=True, slots=True)
class StateChanged:
    """The competition has entered another state."""

    state: CompetitionState


@dataclass(frozen=True, slots=True)
class ConveyorPower:
    """Command to run the conveyor at this power [%]."""

    power: float


@dataclass(frozen=True, slots=True)
class PopulationRestart:
    """Command to restart the conveyor's parts from the first one."""


@dataclass(frozen=True, slots=True)
class OrderAnnounced:
    """An order is announced and becomes the active one. `interrupts` is the id of the order that it interrupts."""

    order: Order
    reason: AnnouncementReason
    interrupts: str | None = None


@dataclass(frozen=True, slots=True)
class KitSubmitted:
    """A tray was judged.

    Attributes:
        score: the score of that kit, with the evidence, or with `refusal` if no order in progress asks for the kit.
        is_repeated: True if the kit was submitted before; `score` is then the first one.
        fates: for each ordered part its fate if it is missing, else None; empty if unknown.
    """

    tray_id: str
    kit_type: str
    score: KitScore
    is_repeated: bool = False
    fates: tuple[Fate | None, ...] = ()


@dataclass(frozen=True, slots=True)
class OrderCompleted:
    """The active order has all its kits and is closed. `resumes` is the id of the order that it had interrupted."""

    score: OrderScore
    resumes: str | None = None


@dataclass(frozen=True, slots=True)
class TrialEnded:
    """The trial is over and its score final.

    `process_time` is the time from the start to the end of the game [ns]; 0 if the game was never started.
    """

    reason: EndReason
    score: GameScore
    process_time: int
