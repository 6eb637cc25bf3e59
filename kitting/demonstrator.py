"""Agent whose runs are to be learned from: the bundled agent, with a style of its own in each run, and with mistakes.

A style follows from the seed of the run: how fast it moves, how long it hesitates, where the cup meets a part. In a
quarter of the runs it closes the cup above its first part, and grasps again. In another quarter it lays the first part
beside its place, and corrects that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Self, cast

from cellwright.clients.agents.kitter.agent import KitterAgent
from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc
from cellwright.clients.agents.kitter.pick_and_place import Held, Manipulator, raised
from cellwright.clients.agents.kitter.postures import Knots, Postures
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.clients.client import Client
from cellwright.engine.random_streams import generator
from cellwright.util.pose import Pose
from kitting.inside import cell_of

STREAM: Final = "demonstrator/style"
"""Name of the random stream of styles, a child of the run's seed."""
SLOWEST: Final = 1.6
"""Greatest factor of the durations of motions between stations."""
LONGEST_PAUSE: Final = 0.5
"""Longest hesitation before a part is grasped or laid down [s]."""
GRIPS: Final = 5
"""Number of places on a part where the cup may meet it, up to 6 mm from the best one."""
MISTAKES: Final = 0.25
"""Share of the runs with each of the two mistakes."""
MISS: Final = 0.02
"""Height [m] above a part at which the cup closes in vain."""
SLIP: Final = 0.02
"""Distance [m] from its place at which a part is laid down by mistake."""


@dataclass(frozen=True, slots=True)
class Style:
    """Style of a run.

    Attributes:
        pace: factor of the durations of motions between stations, from 1.
        pause: hesitation before a part is grasped or laid down [s].
        grip: number of the place where the cup meets a part.
        misses: number of grasps in vain, before the first part.
        slip: way [m] along x and y by which the first part is laid beside its place; zeros for none.
    """

    pace: float = 1.0
    pause: float = 0.0
    grip: int = 0
    misses: int = 0
    slip: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def draw(cls, seed: int) -> Self:
        """Return the style of a seed.

        Example:
            >>> Style.draw(7) == Style.draw(7), 1.0 <= Style.draw(7).pace <= SLOWEST
            (True, True)
        """
        chance = generator(seed, STREAM)
        pace, pause = chance.uniform(1.0, SLOWEST), chance.uniform(0.0, LONGEST_PAUSE)
        grip, mistake, way = int(chance.integers(GRIPS)), chance.uniform(), chance.uniform(0.0, 2.0 * math.pi)
        slips = MISTAKES <= mistake < 2.0 * MISTAKES
        slip = (SLIP * math.cos(way), SLIP * math.sin(way)) if slips else (0.0, 0.0)
        return cls(float(pace), float(pause), grip, int(mistake < MISTAKES), slip)


class Demonstrator(KitterAgent):
    """Agent that works in the style of the run's seed, which it reads from the cell in its process."""

    def __init__(self) -> None:
        self._style = Style()

    def run(self, client: Client) -> None:
        """Work until the competition is over.

        Raises:
            UsageError: the cell is in another process.
        """
        self._style = Style.draw(cell_of(client).seed)
        super().run(client)

    def hand(self, client: Client, arm: KitterArm, catalogue: Catalogue, places: Workplace) -> Manipulator:
        """Return a hand with the style of the run."""
        arm.postures = cast("Postures", PacedPostures(arm.postures, self._style.pace))
        return StyledHand(client, arm, catalogue, places, self._style)


class PacedPostures:
    """Postures of an arm that moves slower between them; all else is that of the arm.

    Args:
        postures: those of the arm.
        pace: factor of the durations.
    """

    def __init__(self, postures: Postures, pace: float) -> None:
        self._postures, self._pace = postures, pace

    def __getattr__(self, name: str) -> Any:
        return getattr(self._postures, name)

    def motion(self, start: Sequence[float], stops: Iterable[Sequence[float]]) -> Knots:
        """Return the motion from one posture to others, with a rest at each."""
        times, positions, velocities = self._postures.motion(start, stops)
        slower = [[value / self._pace for value in each] for each in velocities]
        return Knots([self._pace * time for time in times], positions, slower)


class StyledHand(Manipulator):
    """Hand with a style: it hesitates, grips where it does, and makes the mistakes of the style once.

    Args:
        client: the client.
        arm: the arm.
        catalogue: figures of the part types.
        workplace: places of the cell.
        style: the style.
    """

    def __init__(
        self, client: Client, arm: KitterArm, catalogue: Catalogue, workplace: Workplace, style: Style
    ) -> None:
        super().__init__(client, arm, catalogue, workplace)
        self._style, self._misses, self._slip = style, style.misses, style.slip

    def from_rest(
        self,
        part_type: str,
        world_T_part: Pose,
        rail: float,
        *,
        is_turned: bool = False,
        attempt: int = 0,
        neighbours: Sequence[Disc] = (),
    ) -> Held | None:
        """Take a part at rest, as `Manipulator` does; the first grasps may be in vain."""
        self._client.sleep(self._style.pause)
        grip = (attempt + self._style.grip) % GRIPS
        if self._misses:
            self._misses -= 1
            above = raised(world_T_part, MISS)
            held = super().from_rest(part_type, above, rail, is_turned=is_turned, attempt=grip, neighbours=neighbours)
            if held is not None:  # it was taller than thought
                return replace(held, gripper_T_part=held.gripper_T_part @ above.inverse() @ world_T_part)
        return super().from_rest(
            part_type, world_T_part, rail, is_turned=is_turned, attempt=grip, neighbours=neighbours
        )

    def put_down(
        self, held: Held, world_T_part: Pose, rail: float, on_release: Callable[[], None] = lambda: None
    ) -> bool:
        """Put a held part down, as `Manipulator` does; the first one may come to lie beside its place."""
        self._client.sleep(self._style.pause)
        (dx, dy), self._slip = self._slip, (0.0, 0.0)
        x, y, z = world_T_part.position
        beside = replace(world_T_part, position=(x + dx, y + dy, z))
        return super().put_down(
            held, beside if self.can_put_down(held, beside, rail) else world_T_part, rail, on_release
        )
