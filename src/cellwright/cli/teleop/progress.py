"""What somebody sees while a robot's node runs: lines that stay, and on a terminal one that moves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console

from cellwright.cli.bar import Tell, bar
from cellwright.robot.node import RobotNode


class NodeProgress:
    """Tells on a console how a node goes.

    Args:
        console: where to.
        node: what runs.
        until: the simulation time [s] at which it is to stop, if any.
        factor: simulated seconds a wall second so far, if time keeps to the wall clock.
    """

    def __init__(self, console: Console, node: RobotNode, *, until: float | None, factor: Callable[[], float | None]):
        self._console, self._node, self._until, self._factor = console, node, until, factor
        self._bar: Tell | None = None

    @contextmanager
    def running(self) -> Iterator[None]:
        """Tell of what happens inside."""
        try:
            with bar(self._console, self._node.name, self._until) as self._bar:
                yield
        finally:
            self._bar = None

    def update(self) -> None:
        """Show how far it is, where somebody sees it move."""
        if self._bar is None:
            return
        node, factor = self._node, self._factor()
        pace = "" if factor is None else f"  {factor:.2f} x real time"
        commands = f"  {node.counts.taken} commands taken, {node.refused} refused, {node.counts.ignored} ignored"
        time = node.simulation.time
        self._bar(time if self._until else None, f"{time:.1f} s{pace}{commands}")

    def line(self, text: str) -> None:
        """A line that stays, with the simulation time."""
        self._console.print(
            f"{self._node.simulation.time:9.3f} s  {text}", markup=False, soft_wrap=True, style="yellow"
        )
