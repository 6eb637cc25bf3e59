"""Clones of the belt, and the bodies of the engine that they take in turn.

A clone has a body only while it is in play. After it has left, another clone of its type takes the body: so the cost of
a step grows with the clones that are about at once, not with those of the whole run.
"""

from bisect import bisect_right
from collections import Counter
from collections.abc import Sequence

from cellwright.config.layout.layout import Belt
from cellwright.config.trial.trial import Trial


def clone_name(name: str) -> str:
    """Return the full model name of a clone of the belt: `populate_conveyor|gear_part_clone_0`."""
    return f"populate_conveyor|{name}"


def first_bodies(trial: Trial) -> tuple[str, ...]:
    """Return the types of the bodies for clones that a run begins with, type by type.

    Of each type there are as many as ride on the belts at once, as many as a kit asks for, and one that is free; but
    never more than clones. If a program keeps more, `more_bodies` follows.
    """
    clones = Counter(kind for _, kind in trial.belt_clones())
    kits = [Counter(each.type for each in kit.objects) for order in trial.orders for kit in order.kits]
    riding = {kind: sum(_riding(trial, belt, kind) for belt in trial.layout.belts) for kind in clones}
    wanted = {kind: riding[kind] + max((kit[kind] for kit in kits), default=0) + 1 for kind in clones}
    return tuple(kind for kind, pool in clones.items() for _ in range(min(pool, wanted[kind])))


def more_bodies(bodies: Sequence[str], kind: str, pool: int) -> tuple[str, ...]:
    """Return the types of the bodies with twice as many of one type, but never more than its `pool` of clones."""
    present = list(bodies).count(kind)
    return (*bodies, *[kind] * min(present, pool - present))


def _riding(trial: Trial, belt: Belt, kind: str) -> int:
    """Return the largest number of clones of a type on a belt, if a program takes none."""
    flow = [part for part in trial.belt_parts if part.belt == belt.name]
    parts = sorted((part for part in flow if part.type == kind), key=lambda part: part.time)
    if not parts:
        return 0
    period = max(part.time for part in flow)
    times = [turn * period + part.time for turn in range(trial.options.belt_population_cycles) for part in parts]
    start = min(belt.along((belt.spawn @ part.pose).position) for part in parts)
    ride = (belt.exit - start) / belt.speed
    return max(count - bisect_right(times, time - ride) for count, time in enumerate(times, 1))
