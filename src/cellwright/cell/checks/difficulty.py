"""Difficulty of a trial: its demands on a program, and the places where parts fall that are within reach."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from cellwright.cell.checks.reach import Reach, reaches
from cellwright.config.layout.layout import Layout, is_on_plate
from cellwright.config.trial.trial import DropRegion, KitObject, Order, Trial
from cellwright.util.pose import Vector3

_UPSIDE_DOWN = -0.5  # height of a part's own z axis below which it counts as lying upside down: tilted by over 120 deg
DifficultyKind: TypeAlias = Literal[
    "several_kits",
    "interrupt",
    "never_announced",
    "belt_only",
    "faulty",
    "short",
    "no_spare",
    "turned_over",
    "dropped_in_reach",
    "dropped_on_tray",
    "dropped_out_of_reach",
    "off_tray",
]


def place_of(point: Vector3, layout: Layout) -> str:
    """Name the place under a point of the world [m]: "AGV 1", "bin 7", "the belt", else "the floor"."""
    return _surface_under(point, layout)[0]


def is_within_reach(point: Vector3, layout: Layout, arms: Iterable[Reach]) -> bool:
    """Return whether some arm can lower its tool, pointing down, to an object that fell at a point of the world.

    The object comes to rest on the surface under the point. Obstacles are ignored, so a point may be out of reach all
    the same.
    """
    x, y, _ = point
    _, top = _surface_under(point, layout)
    return any(bool(arm.mask(np.array((x, y, top)))) for arm in arms)


def _surface_under(point: Vector3, layout: Layout) -> tuple[str, float]:
    """Return the place under a point in words, and the height of its surface [m]."""
    x, y, _ = point
    for agv in layout.carriers:
        if agv.covers(x, y):
            return f"AGV {agv.number}", agv.surface
    for each in layout.bins:
        if each.covers(x, y):
            return each.name.replace("bin", "bin "), each.surface
    for belt in layout.belts:
        if belt.covers(x, y):
            return "the belt", belt.surface
    return "the floor", 0.0


@dataclass(frozen=True, slots=True)
class Difficulty:
    """One demand on a program; `kind` for programs, `text` for people."""

    kind: DifficultyKind
    text: str


@dataclass(frozen=True, slots=True)
class PartSupply:
    """Supply of parts of a type: the number in the cell at the start, on the belt, and of faulty ones."""

    lying: int
    belt: int
    faulty: int

    @property
    def good(self) -> int:
        """Number of parts that are not faulty."""
        return self.lying + self.belt - self.faulty


def difficulties(trial: Trial) -> tuple[Difficulty, ...]:
    """Return the difficulties of a trial, in the order in which a program meets them.

    Example:
        >>> from cellwright import load_trial
        >>> [each.text for each in difficulties(load_trial("final02"))]
        ['pulley_part to be turned over']
    """
    return (
        *_order_difficulties(trial),
        *_supply_difficulties(trial),
        *_pose_difficulties(trial),
        *_drop_difficulties(trial),
    )


def ordered_types(trial: Trial) -> Counter[str]:
    """Count the parts of each type in all orders, in the order in which the orders name them."""
    return Counter(ordered.type for ordered in _objects(trial.orders))


def supply(trial: Trial, part_type: str) -> PartSupply:
    """Return the supply of parts of a type; belt parts are counted to the belt's end."""
    lying = [part for part in (*trial.bin_parts, *trial.extra_parts) if part.type == part_type]
    on_belt = [name for name, kind in trial.belt_clones() if kind == part_type]
    names = [part.name.rpartition("|")[2] for part in lying] + on_belt
    return PartSupply(len(lying), len(on_belt), sum(name in trial.faulty_parts for name in names))


def _order_difficulties(trial: Trial) -> Iterator[Difficulty]:
    for order in trial.orders:
        if len(order.kits) > 1:
            which = f" of {order.order_id}" if len(trial.orders) > 1 else ""
            yield Difficulty("several_kits", f"{len(order.kits)} equal kits{which}")
    for order in trial.orders:
        for count, wants in ((order.wanted_parts, "wants"), (order.unwanted_parts, "does not want")):
            if count is not None:
                parts = f"a part that it {wants} is" if count == 1 else f"{count} parts that it {wants} are"
                yield Difficulty("interrupt", f"{order.order_id} is announced when {parts} on a tray")
        if order.start_time is not None and order.start_time > 0:
            yield Difficulty("interrupt", f"{order.order_id} is announced after {order.start_time:g} s")
        elif order.start_time is order.wanted_parts is order.unwanted_parts is None:
            yield Difficulty("never_announced", f"{order.order_id} is never announced")


def _supply_difficulties(trial: Trial) -> Iterator[Difficulty]:
    counts = ordered_types(trial)
    found = {part_type: supply(trial, part_type) for part_type in counts}
    only = [part_type for part_type, each in found.items() if each.belt and not each.lying]
    if only:
        yield Difficulty("belt_only", f"{_listed(only)} only on the belt")
    for part_type, each in found.items():
        if each.faulty:
            yield Difficulty("faulty", f"{each.faulty} of {each.lying + each.belt} {part_type} faulty")
    for part_type, each in found.items():
        if each.good < counts[part_type]:
            yield Difficulty("short", f"{each.good} good {part_type} for the {counts[part_type]} ordered")
    exact = [part_type for part_type, each in found.items() if each.good == counts[part_type]]
    if exact:
        yield Difficulty("no_spare", f"no {_listed(exact, 'or')} to spare")


def _pose_difficulties(trial: Trial) -> Iterator[Difficulty]:
    objects = _objects(trial.orders)
    heights = [(each.type, each.pose.rotate((0.0, 0.0, 1.0))[2]) for each in objects]
    turned = dict.fromkeys(kind for kind, height in heights if height < _UPSIDE_DOWN)
    if turned:
        yield Difficulty("turned_over", f"{_listed(list(turned))} to be turned over")
    places = [each.pose.position[:2] for each in objects]
    off = sum(not any(is_on_plate(x, y, agv.plate) for agv in trial.layout.carriers) for x, y in places)
    if off:
        yield Difficulty("off_tray", f"{off} of {len(objects)} ordered places lie off the tray")


def _drop_difficulties(trial: Trial) -> Iterator[Difficulty]:
    ordered = ordered_types(trial)
    grouped: dict[tuple[DifficultyKind, str, str], list[str]] = {}
    regions = [region for region in trial.drop_regions if region.type in ordered]
    # a trial without an arm is one to which each program adds its own: the usual one
    arms = reaches(replace(trial, has_arm=True)) if regions else ()
    for region in regions:
        kind, where = _drop_kind(region, trial.layout, arms)
        places = grouped.setdefault((kind, region.type, where), [])
        places.append(place_of(region.centre, trial.layout))
    for (kind, part_type, where), places in grouped.items():
        yield Difficulty(kind, f"{part_type} dropped over {_listed(sorted(set(places)))}, {where}")


def _drop_kind(region: DropRegion, layout: Layout, arms: Iterable[Reach]) -> tuple[DifficultyKind, str]:
    """Return the place where a part falls, as a kind of demand and in words."""
    point = region.destination.position
    place = place_of(point, layout)
    if place.startswith("AGV"):
        return "dropped_on_tray", "onto the tray"
    if not is_within_reach(point, layout, arms):
        return "dropped_out_of_reach", "out of reach"
    return "dropped_in_reach", f"onto {place}"


def _objects(orders: tuple[Order, ...]) -> list[KitObject]:
    return [each for order in orders for kit in order.kits for each in kit.objects]


def _listed(words: list[str], last: str = "and") -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}"
