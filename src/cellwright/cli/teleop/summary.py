"""What came of a robot's node, for people and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from cellwright.cli import lines
from cellwright.cli.teleop.options import TeleopOptions
from cellwright.robot.node import RobotNode
from cellwright.running.run import versions
from cellwright.running.serving import Pace

if TYPE_CHECKING:
    from cellwright.viewer.filming import Made


@dataclass
class Ran:
    """What came of a node."""

    outcome: str = "stopped"
    error: str = ""
    wall: float = 0.0
    pace: Pace | None = field(default=None)
    recordings: Sequence[Path] = ()
    is_recorded: bool = True
    videos: Sequence[Made] = ()


def show(console: Console, node: RobotNode, wanted: TeleopOptions, ran: Ran) -> None:
    """Tell people what came of it."""
    counts = node.counts
    console.print()
    note = partial(lines.note, console)
    note("commands", f"{counts.taken} taken, {node.refused} refused, {counts.ignored} ignored")
    for source, count in sorted(node.bus.refusals.counts.items()):
        note(f"refused {count}", source)
    note("simulated" if wanted.driver is None else "ran", f"{node.simulation.time:.1f} s in {ran.wall:.1f} s")
    if ran.pace is not None:
        note("pace", lines.pace_text(ran.pace))
    if wanted.verbose:
        note("state hash", node.simulation.state_hash())
        note("versions", ", ".join(f"{name} {version}" for name, version in versions().items()))


def document(node: RobotNode, wanted: TeleopOptions, ran: Ran, status: int) -> dict[str, Any]:
    """The summary as JSON values; times in s."""
    return {
        "robot": node.name,
        "motion": wanted.motion.value,
        "timestep": float(wanted.timestep),
        "outcome": ran.outcome,
        "exit_status": status,
        "error": ran.error,
        "simulated": node.simulation.time,
        "wall": ran.wall,
        "steps": node.simulation.clock.tick,
        "state_hash": node.simulation.state_hash(),
        "commands": {"taken": node.counts.taken, "refused": node.refused, "ignored": node.counts.ignored},
        "refused": dict(node.bus.refusals.counts),
        "unknown_names": list(node.commander.notices.unknown),
        "pace": None if ran.pace is None else asdict(ran.pace),
        "recordings": [str(path) for path in ran.recordings],
        "videos": list(ran.videos),
        "versions": versions(),
    }
