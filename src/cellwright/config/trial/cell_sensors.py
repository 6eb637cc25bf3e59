"""Sensors under `sensors` in the section `cell`: placed over bins, trays and belts, on belts, or by a pose."""

import math
from collections.abc import Mapping

from cellwright.config.layout.keys import ANGLE, COORDINATE
from cellwright.config.layout.reader import Cell
from cellwright.config.layout.surfaces import Surface, surfaces
from cellwright.config.parsing.quantities import quantity
from cellwright.config.parsing.reader import Keys, Reader
from cellwright.config.parsing.tree import Entry, Table, YamlNode, shortened, with_on
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.sensors import MAX_SENSORS, check_change_topics, check_sensor_name, reserved_names
from cellwright.config.trial.values import SENSOR_TYPES
from cellwright.util import plugins as plugins
from cellwright.util.errors import suggestion
from cellwright.util.pose import Pose

BESIDE, BEAM_HEIGHT = 0.06, 0.003
"""Distance of a sensor on a belt from the belt's edge, and its height over the surface, as of 2017's break beam [m]."""
PLACES = ("pose", "over", "on")
"""Entries that say where a sensor is; it has one of them."""

SENSOR = Keys(
    {"type": Reader.name},
    {
        "over": Reader.name,
        "on": Reader.name,
        "height": quantity(0.0, 10.0, "m"),
        "along": quantity(0.0, 100.0, "m"),
        "across": COORDINATE,
        "turn": ANGLE,
        "pose": Reader.pose,
    },
    strict="entry",
    texts="cell-sensors",
)
"""Keys of a sensor of a cell."""


def read_cell_sensors(cell: Cell, others: tuple[SensorConfig, ...], reader: Reader) -> tuple[SensorConfig, ...]:
    """Return the sensors of a cell; `others` are those of the section of 2017, whose names are taken."""
    if cell.sensors is None:
        return ()
    if len(cell.sensors.entries) + len(others) > MAX_SENSORS:
        reader.problems.error(cell.sensors, f"too many sensors (at most {MAX_SENSORS})")
        return ()
    known, taken, reserved = (
        {each.name: each for each in surfaces(cell.layout)},
        {each.name for each in others},
        reserved_names(cell.layout),
    )
    types = (*SENSOR_TYPES, *plugins.names("sensors"))
    found = []
    for entry in cell.sensors.entries.values():
        name, table = reader.text_key(entry), reader.table(entry.value)
        if name is None or table is None:
            continue
        table = with_on(table)
        values = SENSOR.read(table, reader)
        if values.get("type", types[0]) not in types:
            hint = suggestion(values["type"], types)
            reader.problems.error(table.entries["type"].value, f"there is no sensor type {values['type']!r}{hint}")
            continue
        if name in taken or name in known:
            thing = "sensor of the section sensors" if name in taken else "bin, belt or tray"
            reader.problems.error(entry, f"a {thing} has this name; choose another")
            continue
        pose = _pose(entry, table, values, cell, known, reader)
        if SENSOR.complete(values) and pose is not None:
            found.append(SensorConfig(name, values["type"], pose))
            check_sensor_name(entry, found[-1], reserved, reader)
    check_change_topics(cell.sensors, (*others, *found), reader)
    return tuple(found)


def _pose(
    entry: Entry, table: Table, values: dict[str, object], cell: Cell, known: Mapping[str, Surface], reader: Reader
) -> Pose | None:
    written = [name for name in PLACES if name in table.entries]
    if len(written) != 1:
        got = " and ".join(written) or "none of them"
        reader.problems.error(entry, f"write over: NAME, on: NAME or pose: {{xyz, rpy}} (got {got})")
        return None
    place = written[0]
    if place not in values:
        return None
    useless = {"pose": ("height", "along", "across", "turn"), "over": (), "on": ("turn",)}[place]
    for name in useless:
        if name in table.entries:
            reader.problems.error(table.entries[name], f"has no meaning with {place}; leave it out")
    if place == "pose":
        pose = values["pose"]
        assert isinstance(pose, Pose)
        return pose
    surface = _surface(table.entries[place].value, str(values[place]), cell, known, reader)
    if surface is None:
        return None
    numbers = {name: value for name, value in values.items() if isinstance(value, float)}
    return (_over if place == "over" else _on)(table, numbers, surface, reader)


def _surface(node: YamlNode, name: str, cell: Cell, known: Mapping[str, Surface], reader: Reader) -> Surface | None:
    """Return the surface of that name; one that was refused has been reported."""
    if name not in known and name not in cell.refused:
        reader.problems.error(
            node, f"the cell has no bin, belt or tray {shortened(name)!r}{suggestion(name, list(known))}"
        )
    return known.get(name)


def _over(table: Table, values: dict[str, float], surface: Surface, reader: Reader) -> Pose | None:
    """Return the pose of a sensor that looks straight down, with the wide side of its view along the longer edge."""
    height = values.get("height")
    if height is None:
        if "height" not in table.entries:
            reader.problems.error(table, "write height, the distance from the surface [m], beside over")
        return None
    place = _on_surface(table, values, surface, reader)
    if place is None:
        return None
    wide = math.pi / 2 if surface.size[0] >= surface.size[1] else 0.0
    turn = wide + values.get("turn", 0.0)
    return surface.middle @ Pose.from_rpy((*place, height), (0.0, math.pi / 2, turn))


def _on(table: Table, values: dict[str, float], surface: Surface, reader: Reader) -> Pose | None:
    """Return the pose of a sensor that stands at the left edge of a belt and looks across it."""
    if not surface.is_belt:
        reader.problems.error(table.entries["on"].value, "must name a belt; write over for a bin or a tray")
        return None
    place = _on_surface(table, values, surface, reader)
    if place is None:
        return None
    across = values.get("across", surface.size[1] / 2 + BESIDE)
    height = values.get("height", BEAM_HEIGHT)
    return surface.middle @ Pose.from_rpy((place[0], across, height), (0.0, 0.0, -math.copysign(math.pi / 2, across)))


def _on_surface(table: Table, values: dict[str, float], surface: Surface, reader: Reader) -> tuple[float, float] | None:
    """Return x and y on a surface: `along` counts from the start of a belt, `across` from its middle to the left."""
    if not surface.is_belt:
        for name in ("along", "across"):
            if name in table.entries:
                reader.problems.error(table.entries[name], "is for belts alone; leave it out")
        return 0.0, 0.0
    length = surface.size[0]
    along = values.get("along", length / 2)
    if along > length:
        message = f"must be at most the belt's length of {length:g} m (got {along:g})"
        reader.problems.error(table.entries["along"], message)
        return None
    return along - length / 2, values.get("across", 0.0)
