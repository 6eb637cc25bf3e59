"""Keys of the section `cell`: each entry with its reader.

Lengths are in m, angles in rad; all places are in the frame of the cell, which `frame` moves.
"""

from typing import get_args

from cellwright.config.layout.arm_reader import by_name, mounted
from cellwright.config.layout.arms import Axis, DriveKind, JointNames, MountKind
from cellwright.config.layout.names import read_namespace
from cellwright.config.layout.tool_reader import read_tool
from cellwright.config.layout.values import (
    block,
    floor_line,
    list_of,
    on_floor,
    placed,
    read_colour,
    read_sides,
    read_way,
    section_of,
    turned,
)
from cellwright.config.models.reader import read_primitives
from cellwright.config.parsing.quantities import quantities, quantity
from cellwright.config.parsing.reader import Keys, Reader, number, one_of, section
from cellwright.config.parsing.schema import Elsewhere, words
from cellwright.config.robot.collision_shapes import THRESHOLDS, CollisionShapes, MeshContact

MAX_DISTANCE = 100.0
"""Maximum coordinate in a cell of one's own [m]."""
MIN_BELT, MAX_BELT = 0.5, 60.0
"""Bounds of the length of a belt [m]."""
MAX_TRAY = (0.54, 1.4)
"""Maximum edges along x and y of the tray of a carrier [m]: what its quality control sensor sees."""
MAX_BLOCKS = 100
"""Maximum number of boxes of a structure, and of lines on the floor."""
MIN_EDGE, MAX_EDGE = 0.05, 20.0
"""Bounds of the edges of bins, and of the width of a belt [m]."""

DROP = "drop"
"""End of a belt without a wall."""

COORDINATE = quantity(-MAX_DISTANCE, MAX_DISTANCE, "m")
ANGLE = quantity(-10.0, 10.0, "rad")
PLACE = quantities((2,), COORDINATE, "[x, y]")
POINT = quantities((3,), COORDINATE, "[x, y, z]")
_EDGE = quantity(MIN_EDGE, MAX_EDGE, "m")
_SIDE = quantity(0.001, 100.0, "m")
_HEIGHT = quantity(0.05, 5.0, "m")
FRAME = Keys({"at": POINT}, {"turn": ANGLE}, strict="entry", texts="cell-places")
_POSE = section(FRAME, turned)

MOVE = Keys({"at": PLACE}, {"turn": ANGLE}, strict="entry", texts="cell-frame")
"""Keys of `frame`."""

BIN = Keys(
    {"at": PLACE},
    {
        "turn": ANGLE,
        "size": quantities((2,), _EDGE, "[x, y]"),
        "surface": _HEIGHT,
        "grid_height": _HEIGHT,
        "walls": quantity(0.0, 2.0, "m"),
        "open": read_sides,
        "gap": quantity(0.0, 1.0, "m"),
        "model_turn": ANGLE,
    },
    strict="entry",
    texts="cell-bins",
)
"""Keys of a bin."""

WALL = Keys(
    {"at": POINT}, {"turn": ANGLE, "size": quantities((3,), _EDGE, "[x, y, z]")}, strict="entry", texts="cell-wall"
)
"""Keys of a belt's wall."""

BELT = Keys(
    optional={
        "from": PLACE,
        "to": PLACE,
        "at": PLACE,
        "turn": ANGLE,
        "length": quantity(MIN_BELT, MAX_BELT, "m"),
        "width": _EDGE,
        "surface": _HEIGHT,
        "thickness": quantity(0.02, 1.0, "m"),
        "speed": quantity(0.01, 2.0, "m/s"),
        "spawn": _POSE,
        "frame": _POSE,
        "ends": one_of(("wall", DROP), "end of a belt"),
        "wall": section(WALL, dict),
    },
    strict="entry",
    texts="cell-belts",
)
"""Keys of a belt."""

PATH = Keys({"out": read_way, "back": read_way}, strict="entry", texts="cell-path")
"""Keys of a carrier's path."""

CARRIER = Keys(
    {"at": PLACE},
    {
        "turn": ANGLE,
        "path": section(PATH, dict),
        "tray": quantities((2,), _EDGE, "[x, y]"),
        "tray_frame": _POSE,
        "quality_sensor": Reader.pose,
        "colour": read_colour,
    },
    strict="entry",
    texts="cell-carriers",
)
"""Keys of a carrier."""

TRAY = Keys(
    {"at": PLACE},
    {"turn": ANGLE, "size": quantities((2,), _EDGE, "[x, y]"), "surface": _HEIGHT, "rim": quantity(0.0, 1.0, "m")},
    strict="entry",
    texts="cell-trays",
)
"""Keys of a fixed tray."""

MOUNT = Keys(
    {"kind": one_of(get_args(MountKind), "kind of mount"), "at": quantities((2, 3), COORDINATE, "[x, y]")},
    {
        "turn": ANGLE,
        "axis": one_of(get_args(Axis), "axis"),
        "range": quantities((2,), COORDINATE, "[from, to]"),
        "speed": quantity(0.01, 10.0, "m/s"),
        "effort": quantity(1.0, 1e5, "N"),
        "size": quantities((2,), _EDGE, "[x, y]"),
        "arm": Reader.name,
        "robot": Reader.name,
        "link": Reader.name,
    },
    strict="entry",
    texts="cell-mount",
)
"""Keys of an arm's mount."""

COLLISION = Keys(
    optional={
        "kind": one_of(get_args(MeshContact), "kind of shapes"),
        "threshold": number(*THRESHOLDS),
        "primitives": read_primitives,
    },
    strict="entry",
    texts="cell-collision",
)
"""Keys of the shapes that an arm touches with."""

JOINT_LIMITS = Keys(
    optional={
        "lower": quantity(-100.0, 100.0, "rad or m"),
        "upper": quantity(-100.0, 100.0, "rad or m"),
        "effort": quantity(0.1, 1e5, "N m or N"),
        "velocity": quantity(0.01, 100.0, "rad/s or m/s"),
    },
    strict="entry",
    texts="cell-limits",
)
"""Keys of the limits of a joint."""

ARM = Keys(
    {"mount": section(MOUNT, mounted)},
    {
        "model": Reader.name,
        "tip": Reader.name,
        "tool": read_tool,
        "home": by_name(quantity(-100.0, 100.0, "rad or m")),
        "limits": by_name(section(JOINT_LIMITS, dict)),
        "drives": one_of(get_args(DriveKind), "drives"),
        "bandwidth": quantity(5.0, 200.0, "rad/s"),
        "collision": section(COLLISION, CollisionShapes),
        "namespace": read_namespace,
        "names": one_of(get_args(JointNames), "names of joints"),
    },
    strict="entry",
    texts="cell-arms",
)
"""Keys of an arm."""

HANDS = Keys(optional={"reach": quantity(0.005, 0.3, "m")}, strict="entry", texts="cell-hands")
"""Keys of the hands of a robot that hold parts."""

ROBOT = Keys(
    {"model": Reader.name, "at": POINT},
    {"turn": ANGLE, "namespace": read_namespace, "hands": section(HANDS, dict)},
    strict="entry",
    texts="cell-robots",
)
"""Keys of a robot that is driven over its own topics."""

BLOCK = Keys(
    {"at": POINT, "size": quantities((3,), _SIDE, "[x, y, z]")}, {"turn": ANGLE}, strict="entry", texts="cell-blocks"
)
"""Keys of a box of a structure."""

_BLOCKS = list_of(BLOCK, block, MAX_BLOCKS)
STRUCTURE = Keys(
    {"at": POINT, "boxes": _BLOCKS},
    {"turn": ANGLE, "drawn": _BLOCKS, "frame": section(MOVE, placed)},
    strict="entry",
    texts="cell-structure",
)
"""Keys of a structure: a portal for sensors, a fence, a post or a table."""

LINE = Keys(
    {"at": PLACE, "size": quantities((2,), _SIDE, "[x, y]")}, {"turn": ANGLE}, strict="entry", texts="cell-lines"
)
"""Keys of a line on the floor."""

VIEW = Keys({"at": POINT, "to": POINT}, {"angle": quantity(0.05, 2.5, "rad")}, strict="entry", texts="cell-views")
"""Keys of a view."""

CELL = Keys(
    optional={
        "based_on": Elsewhere({"anyOf": [words(("empty", "gear2017")), {"type": "string", "pattern": r"\.ya?ml$"}]}),
        "frame": section(MOVE, placed),
        "bins": section_of(BIN),
        "belts": section_of(BELT),
        "trays": section_of(TRAY),
        "carriers": section_of(CARRIER),
        "arms": section_of(ARM),
        "arm_clearance": quantity(0.01, 1.0, "m"),
        "robots": section_of(ROBOT),
        "structure": section_of(STRUCTURE),
        "places": section_of(FRAME),
        "views": section_of(VIEW),
        "floor_lines": list_of(LINE, floor_line, MAX_BLOCKS),
        "shelf": on_floor(PLACE),
        "sensors": Reader.table,
    },
    strict="entry",
    texts="cell",
)
"""Keys of the section `cell`."""
