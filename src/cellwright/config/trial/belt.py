"""The section `belt_parts`: what comes along on the conveyor, and when."""

from __future__ import annotations

from cellwright.config.parsing.figures import BeltFigure
from cellwright.config.parsing.tree import Entry, Leaf, Node, Scalar, Table
from cellwright.config.trial.models import PartBook
from cellwright.config.trial.other_years import OtherYear


def read_belt(node: Node, book: PartBook, other_year: OtherYear) -> tuple[BeltFigure, ...]:
    """The parts in the order of their times, ties in the original's order."""
    reader = book.reader
    table = reader.table(node)
    found: dict[tuple[str, Scalar], BeltFigure] = {}
    for entry in reader.entries(table) if table else ():
        if isinstance(entry.value, Table) and "type" in entry.value.entries:
            reader.problems.error(entry, other_year.belt_by_time())
            continue
        written_type = reader.key(entry)
        times = reader.table(entry.value)
        if written_type is None or times is None:
            continue
        part_type = book.part_type(written_type, entry)
        for time in reader.entries(times):
            part = _part(part_type, time, book, other_year)
            if part is None:
                continue
            if (part_type, time.name) in found:
                reader.problems.warn(time, f"{part_type} is on the belt at this time already; only this one is kept")
            found[part_type, time.name] = part
    if not book.admit(node, len(found) * book.options.options.belt_population_cycles):
        return ()
    return tuple(sorted(found.values(), key=lambda part: part.time))


def _part(part_type: str, entry: Entry, book: PartBook, other_year: OtherYear) -> BeltFigure | None:
    reader = book.reader
    if entry.name == "pose":
        reader.problems.error(entry, f"a time [s] is expected here, under it the pose{other_year.belt_without_pose()}")
        return None
    time = reader.number(Leaf(entry.name, entry.place, entry.key))
    if time is None:
        return None
    if isinstance(entry.value, Leaf) and entry.value.value is None:
        reader.problems.error(entry, f"the required entry 'pose' is missing{other_year.belt_without_pose()}")
        return None
    table = reader.table(entry.value)
    if table is None:
        return None
    reader.ignored(table, ("pose",))
    pose = reader.required(table, "pose")
    placement = reader.placement(pose) if pose else None
    if placement is None:
        return None
    if time < 0:
        reader.problems.warn(entry, "a time before the start; the part appears at once")
    return BeltFigure(time, part_type, placement)
