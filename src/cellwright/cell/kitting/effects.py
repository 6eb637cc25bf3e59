"""What the referee wants done or known: plain values, for the cell to carry out, publish and log."""

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

from cellwright.cell.kitting.fates import Fate
from cellwright.cell.kitting.kit_score import KitScore
from cellwright.cell.kitting.scorer import GameScore, OrderScore
from cellwright.config.trial.trial import Order


class CompetitionState(StrEnum):
    """The states of a competition, in the words of its topic."""

    INIT = "init"
    READY = "ready"
    GO = "go"
    END_GAME = "end_game"
    DONE = "done"


class AnnouncementReason(StrEnum):
    """Why an order was announced when it was."""

    TIME = "time"
    IDLE = "no order in progress"
    WANTED_PARTS = "wanted parts on a tray"
    UNWANTED_PARTS = "unwanted parts on a tray"


class EndReason(StrEnum):
    """Why a trial ended."""

    ORDERS_COMPLETE = "all orders complete"
    NO_ORDERS = "no orders"
    TIME_LIMIT = "time limit"
    COMMAND = "ended by command"


@dataclass(frozen=True, slots=True)
class StateChanged:
    """The competition is in another state."""

    state: CompetitionState


@dataclass(frozen=True, slots=True)
class ConveyorPower:
    """The conveyor is to run at this power [%]."""

    power: float


@dataclass(frozen=True, slots=True)
class PopulationRestart:
    """The conveyor's parts are to begin from the first."""


@dataclass(frozen=True, slots=True)
class OrderAnnounced:
    """An order is announced and becomes the active one; `interrupts` is the id of the one that waits for its end."""

    order: Order
    reason: AnnouncementReason
    interrupts: str | None = None


@dataclass(frozen=True, slots=True)
class KitSubmitted:
    """A tray was judged.

    Attributes:
        score: the score of that kit, with the evidence, or with `refusal` when nobody asked for the kit.
        is_repeated: the kit was submitted before; `score` is the one from then.
        fates: for each ordered part what became of it if it is missing, else None; empty where nothing is known.
    """

    tray_id: str
    kit_type: str
    score: KitScore
    is_repeated: bool = False
    fates: tuple[Fate | None, ...] = ()


@dataclass(frozen=True, slots=True)
class OrderCompleted:
    """The active order has all its kits and is closed; `resumes` is the id of that which it had interrupted."""

    score: OrderScore
    resumes: str | None = None


@dataclass(frozen=True, slots=True)
class TrialEnded:
    """The trial is over and its score final.

    `process_time` goes from the start until the end of the game [ns]; it is 0 when it was never started.
    """

    reason: EndReason
    score: GameScore
    process_time: int


Effect: TypeAlias = (
    StateChanged | ConveyorPower | PopulationRestart | OrderAnnounced | KitSubmitted | OrderCompleted | TrialEnded
)
