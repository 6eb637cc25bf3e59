"""What a figure shows, as arrays over time: drawn alike, wherever it was read from."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class JointTrack:
    """One joint.

    Attributes:
        unit: of its positions, "rad" or "m".
        times: (n,) [s].
        positions: (n,) [rad; m].
        told_at: (m,) when there was a target [s].
        targets: (m,) [rad; m]; nan where there was none.
    """

    name: str
    unit: str
    times: Array
    positions: Array
    told_at: Array = field(default_factory=lambda: np.zeros(0))
    targets: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def travel(self) -> float:
        """From its least to its greatest position [rad; m]."""
        return float(np.ptp(self.positions)) if len(self.positions) else 0.0


@dataclass(frozen=True)
class Span:
    """Something that lasted: from when until when [s], and what it was."""

    begin: float
    end: float
    label: str = ""


@dataclass(frozen=True)
class ToolTrack:
    """Where a tool was.

    Attributes:
        frame: in whose coordinates.
        times: (n,) [s].
        positions: (n, 3) [m].
        on: when its suction was on, for one that has any.
        attached: when something hung on it.
    """

    name: str
    frame: str
    times: Array
    positions: Array
    on: Sequence[Span] = ()
    attached: Sequence[Span] = ()


@dataclass(frozen=True)
class TrayPart:
    """A part on a tray.

    Attributes:
        name: of the part, or its type where names are not known.
        begin: from when on it was reported [s].
        end: until when [s].
        verdict: "right", "faulty" or "not ordered" when its kit was judged; empty before that.
    """

    tray: str
    name: str
    begin: float
    end: float
    verdict: str = ""


@dataclass(frozen=True)
class Mark:
    """A moment [s], what happened then, and on which tray, where it was on one."""

    time: float
    label: str
    tray: str = ""


@dataclass(frozen=True)
class ScoreTrack:
    """What had been earned when.

    Attributes:
        times: (n,) [s].
        points: (n,) from then on.
        best: the most that one could have got; None when it is not known.
    """

    times: Array
    points: Array
    best: float | None = None


@dataclass(frozen=True)
class CommandTrack:
    """When commands of one topic or service came, (n,) [s]."""

    name: str
    times: Array


@dataclass(frozen=True)
class Story:
    """All that there is to be drawn of a recording; what it has not is empty.

    Attributes:
        note: by whom, with which seed, and what came of it.
        begin, end: of the recording [s].
        joints: by name of their group.
        trays: names of the trays.
        score: what had been earned; None for what earns nothing.
        marks: orders, kits and the like.
        states: spans of a state, by what it is the state of.
        warning: what is wrong with the recording; empty for one that is whole.
    """

    title: str
    note: str
    begin: float
    end: float
    joints: dict[str, list[JointTrack]] = field(default_factory=dict)
    tools: Sequence[ToolTrack] = ()
    trays: Sequence[str] = ()
    tray_parts: Sequence[TrayPart] = ()
    score: ScoreTrack | None = None
    marks: Sequence[Mark] = ()
    states: dict[str, list[Span]] = field(default_factory=dict)
    commands: Sequence[CommandTrack] = ()
    warning: str = ""
