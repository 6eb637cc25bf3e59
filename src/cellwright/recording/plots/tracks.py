"""Plot data: the content of a figure as arrays over time, independent of its source."""

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
        target_times: (m,) times of the targets [s].
        targets: (m,) [rad; m]; nan where there was none.
    """

    name: str
    unit: str
    times: Array
    positions: Array
    target_times: Array = field(default_factory=lambda: np.zeros(0))
    targets: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def travel(self) -> float:
        """Range of its positions [rad; m]."""
        return float(np.ptp(self.positions)) if len(self.positions) else 0.0


@dataclass(frozen=True)
class Span:
    """A period: begin and end [s], and its label."""

    begin: float
    end: float
    label: str = ""

    @property
    def duration(self) -> float:
        """Its length [s]."""
        return self.end - self.begin


@dataclass(frozen=True)
class CollisionSpan(Span):
    """Period of a collision of a link: its label, and the name of the arm or robot; empty where it is not known."""

    owner: str = ""


@dataclass(frozen=True)
class ToolTrack:
    """Path of a tool.

    Attributes:
        frame: frame of the positions.
        times: (n,) [s].
        positions: (n, 3) [m].
        on: periods with suction on, for a tool that has suction.
        attached: periods with an attached part.
        arm: name of its arm in a cell.
    """

    name: str
    frame: str
    times: Array
    positions: Array
    on: Sequence[Span] = ()
    attached: Sequence[Span] = ()
    arm: str = ""


@dataclass(frozen=True)
class TrackedTrayPart:
    """A part on a tray.

    Attributes:
        name: of the part, or its type if names are not known.
        begin: first time at which it was reported [s].
        end: time from which it was no longer reported [s].
        verdict: "right", "faulty" or "not ordered" when its kit was judged; empty before that.
    """

    tray: str
    name: str
    begin: float
    end: float
    verdict: str = ""


@dataclass(frozen=True)
class Mark:
    """An event: its time [s], its label, and its tray if it has one."""

    time: float
    label: str
    tray: str = ""


@dataclass(frozen=True)
class ScoreTrack:
    """Score over time.

    Attributes:
        times: (n,) [s].
        points: (n,) score from that time on.
        best: attainable score; None if it is not known.
    """

    times: Array
    points: Array
    best: float | None = None


@dataclass(frozen=True)
class CommandTrack:
    """Times of the commands on one topic or service, (n,) [s]."""

    name: str
    times: Array


@dataclass(frozen=True)
class PlotData:
    """Plot data of a recording; what it lacks is empty.

    Attributes:
        note: agent, seed and result, in one line.
        begin, end: of the recording [s].
        joints: by name of their group.
        trays: names of the trays.
        score: score over time; None for what has no score.
        marks: orders, kits and the like.
        collisions: of arms and robots, each with its link and obstacle as label.
        states: periods of each state, by name of the state machine.
        warning: fault of the recording; empty for a complete one.
    """

    title: str
    note: str
    begin: float
    end: float
    joints: dict[str, list[JointTrack]] = field(default_factory=dict)
    tools: Sequence[ToolTrack] = ()
    trays: Sequence[str] = ()
    tray_parts: Sequence[TrackedTrayPart] = ()
    score: ScoreTrack | None = None
    marks: Sequence[Mark] = ()
    collisions: Sequence[CollisionSpan] = ()
    states: dict[str, list[Span]] = field(default_factory=dict)
    commands: Sequence[CommandTrack] = ()
    warning: str = ""
