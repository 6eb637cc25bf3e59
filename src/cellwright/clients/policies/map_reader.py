"""Reader of key maps: each error has its line, and every name is one of the cell that the map is for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from cellwright.clients.policies.dialects import DIALECT_NAMES
from cellwright.clients.policies.key_map import (
    SENTENCE,
    Cell,
    Channels,
    Constant,
    Grip,
    KeyMap,
    Part,
    Picture,
    Skip,
    Source,
    ToChannels,
    ToGripper,
    ToolPose,
    ToTool,
    Words,
)
from cellwright.clients.policies.map_names import MAX_COUNT, channels, is_beyond, named
from cellwright.clients.policies.rotations import SIZES
from cellwright.config.control import period_ticks
from cellwright.config.parsing import reader as read
from cellwright.config.parsing.reader import Keys, Read, Reader
from cellwright.config.parsing.sources import JoinedText, Text, read_texts
from cellwright.config.parsing.tree import Items, Leaf, Located, Problems, Table, YamlNode, describe
from cellwright.config.parsing.yaml_source import parse_mapping
from cellwright.util.errors import DescriptionError, UsageError, did_you_mean

MAX_PIXELS = 4096
"""Greatest width and height of a picture for a policy [px]."""
_FRAMES = ("base", "world", "tool")
_MODES = ("absolute", "delta")


def load_map(path: Path, cell: Cell) -> KeyMap:
    """Read a map for a cell.

    Raises:
        DescriptionError: it cannot be read, or does not fit the cell; `problems` has all errors.
    """
    return _map_of(read_texts([path]), cell)


def map_of_text(text: str, cell: Cell) -> KeyMap:
    """Read the text of a map, such as that in a recording; errors as of `load_map`."""
    return _map_of(JoinedText([Text("the recorded map", text)]), cell)


def _map_of(text: JoinedText, cell: Cell) -> KeyMap:
    problems = Problems()
    root = parse_mapping(text, problems, "a map with observation and actions")
    reader = Reader(problems)
    keys = Keys(
        {"observation": _observation(cell), "actions": _actions(cell)},
        {
            "rate": _rate(cell.timestep),
            "chunk": read.whole(1, MAX_COUNT),
            "stale": read.choice(("drop", "play")),
            "dialect": read.one_of(DIALECT_NAMES, "dialect"),
        },
        strict="entry",
    )
    values = keys.read(root, reader)
    if problems.errors:
        raise DescriptionError(problems.errors, problems.warnings)
    stale = values.pop("stale", None)
    return KeyMap(**values, drops_stale=None if stale is None else stale == "drop", text=text.content)


def _rate(timestep: tuple[int, int]) -> Read:
    def rate(reader: Reader, node: YamlNode) -> float | None:
        found = reader.number(node)
        try:
            return None if found is None else float(period_ticks(found, timestep) and found)
        except UsageError as error:
            reader.problems.error(node, str(error).removeprefix("rate: "))
            return None

    return rate


def _observation(cell: Cell) -> Read:
    kinds: dict[str, Read] = {
        "channels": _section({"channels": channels(cell)}, {}, Channels, {"channels": "names"}),
        "gripper": _grip(cell),
        "pose": _section(
            {"pose": named(tuple(cell.arms), "arm")},
            {"rotation": read.one_of(SIZES, "form of rotations"), "frame": read.choice(_FRAMES[:2])},
            ToolPose,
            {"pose": "arm"},
        ),
        "constant": _section({"constant": _numbers}, {}, Constant, {"constant": "numbers"}),
        "camera": _section(
            {"camera": named(cell.cameras, "camera")},
            {"size": _size, **dict.fromkeys(("turned", "mirrored", "planar", "optional"), Reader.boolean)},
            _picture,
            {"planar": "is_planar"},
        ),
        "text": _section({"text": _text}, {}, Words),
    }

    def source(reader: Reader, node: YamlNode) -> Source | None:
        if isinstance(node, Items):
            found = [_one(kinds, reader, item) for item in node.items]
            if any(isinstance(each, Picture | Words) for each in found) or not found:
                reader.problems.error(node, "must be a list of sources of numbers; give a picture or a text alone")
            return None if None in found else tuple(found)
        if isinstance(node, Table) and _is_nested(node, kinds):
            return table(reader, node)
        one: Source | None = _one(kinds, reader, node)
        return one

    def table(reader: Reader, node: YamlNode) -> dict[str, Source] | None:
        found: dict[str, Source] = {}
        given = reader.table(node)
        for entry in given.entries.values() if given else ():
            if _is_left_out(entry.value, cell):
                continue
            name, value = reader.text_key(entry), source(reader, entry.value)
            if name is not None and value is not None:
                found[name] = value
        if given is not None and not given.entries:
            reader.problems.error(node, "must have an entry, such as state: {channels: all}")
        return found

    return table


def _is_left_out(node: YamlNode, cell: Cell) -> bool:
    """Return whether a node is an optional picture of a camera that the cell lacks."""
    optional = node.get("optional") if isinstance(node, Table) else None
    is_optional = isinstance(optional, Leaf) and optional.value is True
    return is_optional and isinstance(node, Table) and is_beyond(node.get("camera"), cell.cameras)


def _picture(**values: Any) -> Picture:
    values.pop("optional", None)  # it is there
    return Picture(**values)


def _grip(cell: Cell) -> Read:
    section = _section(
        {"gripper": named(cell.grippers, "gripper", cell.grippers_of_arms)},
        {"open": _numbers, "closed": _numbers},
        Grip,
        {"gripper": "name"},
    )

    def grip(reader: Reader, node: YamlNode) -> Grip | None:
        found: Grip | None = section(reader, node)
        if found is not None and len(found.open) != len(found.closed):
            lengths = f"{len(found.open)} and {len(found.closed)}"
            reader.problems.error(node, f"open and closed must have equally many numbers (got {lengths})")
            return None
        return found

    return grip


def _is_nested(table: Table, kinds: Mapping[str, Read]) -> bool:
    """Return whether a mapping holds further entries of an observation, and is no source itself."""
    inner = [entry.value for entry in table.entries.values()]
    return bool(inner) and all(isinstance(each, Table | Items) for each in inner) and not (kinds.keys() & table.entries)


def _actions(cell: Cell) -> Read:
    steps = {"mode": read.choice(_MODES), "scale": Reader.number, "limit": _positive}
    kinds: dict[str, Read] = {
        "channels": _section(
            {"channels": channels(cell)}, {**steps, "offset": Reader.number}, ToChannels, {"channels": "names"}
        ),
        "gripper": _to_gripper(cell),
        "pose": _section(
            {"pose": named(tuple(cell.arms), "arm")},
            {
                **steps,
                "rotation": read.one_of(SIZES, "form of rotations"),
                "frame": read.choice(_FRAMES),
                "turn_scale": Reader.number,
            },
            ToTool,
            {"pose": "arm"},
        ),
        "skip": _section({"skip": read.whole(1, MAX_COUNT)}, {}, Skip, {"skip": "count"}),
    }

    def parts(reader: Reader, node: YamlNode) -> tuple[Part, ...] | None:
        if not isinstance(node, Items) or not node.items:
            reader.problems.error(node, f"must be a list of parts of an action (got {describe(node)})")
            return None
        found = [_one(kinds, reader, item) for item in node.items]
        _check_parts(reader, node, [each for each in found if each is not None])
        return None if None in found else tuple(found)

    return parts


def _to_gripper(cell: Cell) -> Read:
    section = _section(
        {"gripper": named(cell.grippers, "gripper", cell.grippers_of_arms)},
        {
            "threshold": Reader.number,
            "closes": read.choice(("above", "below")),
            "open": Reader.number,
            "closed": Reader.number,
        },
        dict,
        {"gripper": "name", "closes": "closes_above"},
    )

    def part(reader: Reader, node: YamlNode) -> ToGripper | None:
        values = section(reader, node)
        if values is None:
            return None
        ends = [values.pop(name) for name in ("open", "closed") if name in values]
        if not ends:
            return ToGripper(**values)
        if len(set(ends)) != 2 or len(values) > 1:
            reader.problems.error(node, "give two different numbers, open and closed, or threshold and closes alone")
            return None
        return ToGripper(**values, ends=(ends[0], ends[1]))

    return part


def _check_parts(reader: Reader, where: Located, parts: Sequence[Part]) -> None:
    """Refuse two parts for one channel, and steps in the frame of the tool that are none."""
    names = [name for part in parts if isinstance(part, ToChannels) for name in part.names]
    names += [part.name for part in parts if isinstance(part, ToGripper)]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        reader.problems.error(where, f"{twice[0]} has two parts; leave one out")
    tools = [part for part in parts if isinstance(part, ToTool)]
    if any(part.frame == "tool" and not part.steps for part in tools):
        reader.problems.error(where, "frame: tool needs mode: delta; give base or world for an absolute pose")
    if not any(isinstance(part, ToChannels | ToGripper | ToTool) for part in parts):
        reader.problems.error(where, "no part commands anything; add one with channels, gripper or pose")


def _one(kinds: Mapping[str, Read], reader: Reader, node: YamlNode) -> Any:
    """Read a mapping by the first of its keys that names its kind."""
    table = reader.table(node)
    if table is None:
        return None
    found = [name for name in kinds if name in table]
    if found:
        return kinds[found[0]](reader, node)
    given = next((str(name) for name in table.entries), "")
    hint = did_you_mean(given, kinds)
    reader.problems.error(node, f"must have one of {', '.join(kinds)}{f' (got {given})' if given else ''}{hint}")
    return None


def _section(
    required: Mapping[str, Read],
    optional: Mapping[str, Read],
    make: Callable[..., Any],
    names: Mapping[str, str] | None = None,
) -> Read:
    """Return a reader of a mapping for a class; `names` are those of its fields that differ from the keys."""
    keys = Keys(required, optional, strict="entry")

    def section(reader: Reader, node: YamlNode) -> Any:
        table = reader.table(node)
        values = keys.read(table, reader) if table else {}
        if table is None or not keys.complete(values):
            return None
        if "mode" in values:
            values["steps"] = values.pop("mode") == "delta"
        if "closes" in values:
            values["closes"] = values["closes"] == "above"
        return make(**{(names or {}).get(name, name): value for name, value in values.items()})

    return section


def _size(reader: Reader, node: YamlNode) -> tuple[int, int] | None:
    side = read.whole(1, MAX_PIXELS, "px")
    if not isinstance(node, Items) or len(node.items) != 2:
        reader.problems.error(node, f"must be a list of width and height [px] (got {describe(node)})")
        return None
    width, height = (side(reader, item) for item in node.items)
    return None if width is None or height is None else (width, height)


def _positive(reader: Reader, node: YamlNode) -> float | None:
    number = reader.number(node)
    if number is not None and number <= 0.0:
        reader.problems.error(node, f"must be above 0 (got {number:g})")
        return None
    return number


def _numbers(reader: Reader, node: YamlNode) -> tuple[float, ...] | None:
    items = node.items if isinstance(node, Items) else (node,)
    numbers = [reader.number(item) for item in items]
    return None if None in numbers else tuple(float(each) for each in numbers if each is not None)


def _text(reader: Reader, node: YamlNode) -> str | None:
    if isinstance(node, Leaf) and isinstance(node.value, str):
        return node.value
    reader.problems.error(node, f"must be a text, such as '{SENTENCE}' (got {describe(node)})")
    return None
