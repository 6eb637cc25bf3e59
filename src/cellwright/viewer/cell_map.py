"""Map of a trial's cell: everything that stands in it, from above, with names, a scale and the reach of the arm.

x points up and y to the left, as seen by an arm whose rail lies along y.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.ticker import MultipleLocator

from cellwright.cell.checks.clearance import PlaceReach
from cellwright.cell.checks.obstacles import AGV_SIZE, Obstacle, obstacles, world_path
from cellwright.cell.checks.sight import TYPE, corners, looked_at
from cellwright.cell.checks.surfaces import surfaces_in
from cellwright.config.arm import RAIL_LIMIT
from cellwright.config.footprints import PART_TYPES, footprint
from cellwright.config.layout.layout import Belt
from cellwright.config.models.model import ModelShape
from cellwright.config.models.reader import extent
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from cellwright.viewer.map_places import Point, Span, corners_of, edges, shared_area, span
from cellwright.viewer.map_reach import fields

SUFFIXES = (".png", ".svg")
"""Kinds of files that a map can be."""

INK, MUTED, EDGE = "#22313d", "#5c6b77", "#53626d"
BIN, BELT, TRAY, STRUCTURE, PART = "#bcd3e2", "#4b5a55", "#f4f1ea", "#8d979e", "#e9b95a"
RAIL, ARROW, SIGHT = "#1f5f8b", "#a03020", "#7a4fa0"
ON_BELT = "#e3d3f5"
"""Colour of names on a belt, which is dark."""
_OVERHEAD = 1.44
"""Height [m] from which a structure is over everything, and only outlined."""
_MARGIN = 0.55
"""Free space around the cell [m]."""
_LARGEST, _SCALE = 15.0, 1.35
"""Longest side of a map [inches], and inches to a metre where that is not exceeded."""

_ENTRY = 1.9
"""Width of an entry of the legend [inches]."""
_LETTER, _LINE = 0.62, 1.25
"""Width of a letter and height of a line, as shares of the size of a text."""
_ARM = 0.1
"""Radius of the circle that stands for an arm [m]."""
_BESIDE = 0.03
"""Distance of a name from what it names [m]."""


def draw_map(trial: Trial, path: Path, places: Sequence[PlaceReach] = ()) -> None:
    """Write a map of the cell of a trial as a PNG or SVG file.

    Args:
        trial: the trial.
        path: the file.
        places: reach of the arms over the places, which the map then shows in place of parts and views: at each point
            that of the arm that can do most. Without, fields that are out of reach are marked.

    Raises:
        UsageError: the name of the file ends in another suffix.

    Example:
        >>> import cellwright, tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     draw_map(cellwright.load_trial("lesson"), Path(folder) / "lesson.svg")
    """
    check_suffix(path)
    with mpl.rc_context({"font.family": "DejaVu Sans", "svg.fonttype": "none", "svg.hashsalt": "cell"}):
        figure = _Map(trial, places).draw()
        figure.savefig(path, dpi=110, metadata={"Date": None} if path.suffix.lower() == ".svg" else {})


def check_suffix(path: Path) -> None:
    """Raise a `UsageError` if a map cannot be a file of this name."""
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(f"{path}: a map is a PNG or SVG file; give a name that ends in {' or '.join(SUFFIXES)}")


class _Map:
    """Drawing of one map; heights decide what covers what."""

    def __init__(self, trial: Trial, places: Sequence[PlaceReach] = ()) -> None:
        self._trial = trial
        self._obstacles = obstacles(trial)
        self._surfaces = surfaces_in(trial)
        self._places = places
        self._fields = [*fields(trial, places)]
        (left, right), (bottom, top) = self._bounds()
        scale = min(_SCALE, _LARGEST / max(left - right, top - bottom))
        self._metre = 72.0 * scale
        """Length of a metre on the map [points]."""
        self._taken: list[Span] = []
        """Parts, belts and names: names should not cover them."""
        self._size = 8.0 * max(0.7, min(1.0, scale / 1.1))
        self._figure = Figure(figsize=((left - right) * scale + 0.6, (top - bottom) * scale + 0.9))
        width, height = self._figure.get_size_inches()
        box = (0.5 / width, 0.45 / height, 1.0 - 0.6 / width, 1.0 - 0.9 / height)
        self._axes = self._figure.add_axes(box)
        self._axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")

    def draw(self) -> Figure:
        """Return the figure with everything drawn."""
        self._frame()
        self._floor()
        self._things()
        self._belts()
        self._reach()
        if not self._places:
            self._parts()
        self._furniture()
        self._carriers()
        self._arms()
        self._robots()
        self._names()
        if not self._places:
            self._sensors()
        self._structure_names()
        return self._figure

    def _bounds(self) -> tuple[Point, Point]:
        """Return left and right y, and bottom and top x; long belts and paths do not count where others do."""
        trial = self._trial
        points = [
            corner for each in self._obstacles if not each.key.startswith("cell.belts") for corner in each.corners
        ]
        points += [each.pose.position[:2] for each in trial.sensors]
        points += [each.pose.position[:2] for each in trial.furniture]
        points += [end[:2] for arm in trial.arms for end in arm.mount.ends]
        points += [each.pose.position[:2] for each in trial.layout.robots]
        for belt in trial.layout.belts:
            points += [each.position[:2] for each in (belt.spawn, belt.wall) if each is not None]
        x, y = np.array(points or [(-1.0, -1.0), (1.0, 1.0)]).T
        return (y.max() + _MARGIN, y.min() - _MARGIN), (x.min() - _MARGIN, x.max() + _MARGIN)

    def _frame(self) -> None:
        axes = self._axes
        axes.grid(color="#e2e7ea", lw=0.6)
        axes.set_axisbelow(True)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MultipleLocator(1.0))
        axes.set_xlabel("y [m]", color=MUTED, labelpad=1)
        axes.set_ylabel("x [m]", color=MUTED, labelpad=1)
        axes.tick_params(colors=MUTED, labelsize=8)
        for spine in axes.spines.values():
            spine.set_visible(False)
        axes.set_title(self._trial.name, loc="left", fontsize=11, color=INK)
        left, bottom = axes.get_xlim()[0], axes.get_ylim()[0]
        start, height = left - 0.15, bottom + 0.12
        axes.plot((start, start - 1.0), (height, height), color=INK, lw=2.5, zorder=12, solid_capstyle="butt")
        self._text(height + 0.1, start - 0.5, "1 m")
        for mark in dict.fromkeys(mark for mark, _, _ in self._fields):
            axes.plot([], [], "s", ms=7, color=mark.colour, alpha=mark.opacity, label=mark.meaning)
        if any(each.type == TYPE for each in self._trial.sensors) and not self._places:
            axes.plot([], [], "s", ms=7, color=SIGHT, alpha=0.3, label="view of a logical camera")
        if self._trial.carriers:
            axes.plot([], [], "--", color=ARROW, lw=1.2, label="path of an AGV")
        if any(each.wall for each in self._trial.layout.belts):
            axes.plot([], [], color=ARROW, lw=3, label="parts leave here")
        if axes.get_legend_handles_labels()[1]:
            columns = max(2, min(4, int((self._figure.get_figwidth() - 0.5) / _ENTRY)))
            style = {"ncols": columns, "fontsize": 7.5, "frameon": False, "borderaxespad": 0.2}
            axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), **style)

    def _floor(self) -> None:
        for line in self._trial.layout.floor_lines:
            self._rectangle(line.middle, line.size, "#e6d9a8", 1.0, lw=0.0)

    def _things(self) -> None:
        for each in sorted(self._obstacles, key=lambda each: each.high):
            section = each.key.split(".")[1]
            if section == "structure":
                self._structure(each)
            elif section == "bins":
                bin_ = self._trial.layout.bin(each.name)
                self._polygon(each.corners, "#8fb0c6", 3.0, lw=0.5)
                self._rectangle(bin_.pose, bin_.size, BIN, 3.1, lw=0.4)
            elif section == "trays":
                self._polygon(each.corners, TRAY, 3.0)

    def _structure(self, each: Obstacle) -> None:
        if each.low >= _OVERHEAD:
            self._polygon(each.corners, "none", 9.0, lw=0.8, ls=(0, (4, 2)), edgecolor=STRUCTURE)
        else:
            self._polygon(each.corners, STRUCTURE, 4.0 + min(1.0, each.low / 2))

    def _belts(self) -> None:
        for belt in self._trial.layout.belts:
            self._rectangle(belt.centre, belt.size[:2], BELT, 3.0)
            self._taken.append(span(corners_of(belt.centre, belt.size)))
            x, y, _ = belt.spawn.position
            self._axes.plot(y, x, "o", ms=5, color="white", zorder=8)
            self._text(x, y, "parts appear", 0.85, color="white", va="bottom", xytext=(0, 5))
            if belt.wall is not None:
                across = belt.wall_size[0] / 2
                ends = [belt.wall.transform((side * across, 0.0, 0.0))[:2] for side in (-1, 1)]
                self._line(ends, ARROW, 3.0)
            dx, dy, _ = belt.direction
            x, y = self._free_place(belt)
            self._taken.append(((x - 0.2, y - 0.2), (x + 0.2, y + 0.2)))
            self._arrow((x + 0.05 * dx, y + 0.05 * dy), (x + 0.7 * dx, y + 0.7 * dy), "white")
            self._text(x - 0.4 * dx, y - 0.4 * dy, f"{belt.name}\n{belt.speed:g} m/s", color="white")

    def _free_place(self, belt: Belt) -> Point:
        """Return the place on a belt, and on the map, that is farthest from all that is drawn on the belt."""
        (left, right), (bottom, top) = self._axes.get_xlim(), self._axes.get_ylim()
        points = [belt.centre.transform((belt.size[0] * (step / 50 - 0.5), 0.0, 0.0))[:2] for step in range(1, 50)]
        seen = [(x, y) for x, y in points if bottom <= x <= top and right <= y <= left]
        taken = [each.pose.position[:2] for each in self._trial.sensors]
        taken += [each.position[:2] for each in (belt.spawn, belt.wall) if each is not None]
        taken += [(bottom, left), (top, right)]
        return max(seen or points, key=lambda point: min(math.dist(point, each) for each in taken))

    def _reach(self) -> None:
        for mark, middle, size in self._fields:
            self._rectangle(middle, size, mark.colour, 6.0, lw=0.0, alpha=mark.opacity)

    def _parts(self) -> None:
        trial = self._trial
        frames = trial.reference_frames
        for part in (*trial.bin_parts, *trial.extra_parts):
            pose = frames.get(part.frame, Pose()) @ part.pose
            if part.type in PART_TYPES:
                for patch in footprint(part.type, pose).patches:
                    self._rounded(patch.corners, patch.radius)
            else:
                radius = max(map(extent, trial.part_models[part.type].shapes), default=0.05)
                self._rounded((pose.position[:2],), radius)

    def _rounded(self, points: Sequence[Point], radius: float) -> None:
        """Draw all within a distance of the hull of up to four points: a disc, or a rectangle."""
        (low, left), (high, right) = span(points)
        self._taken.append(((low - radius, left - radius), (high + radius, right + radius)))
        if len(points) > 2:
            x, y = np.mean(points, axis=0)
            ordered = sorted(points, key=lambda point: math.atan2(point[1] - y, point[0] - x))
            self._polygon(ordered, PART, 5.0, lw=0.3)
        if radius:
            for x, y in points:
                self._axes.add_patch(Circle((y, x), radius, facecolor=PART, edgecolor=EDGE, lw=0.3, zorder=5))

    def _furniture(self) -> None:
        for piece in self._trial.furniture:
            for shape in piece.model.shapes:
                self._shape(piece.pose @ shape.pose, shape)
            self._text(*piece.pose.position[:2], piece.name)

    def _shape(self, pose: Pose, shape: ModelShape) -> None:
        if shape.kind == "box":
            self._rectangle(pose, shape.size[:2], STRUCTURE, 4.0)
        else:
            radius = shape.size[0] if shape.kind != "mesh" else extent(shape)
            x, y, _ = pose.position
            self._axes.add_patch(Circle((y, x), radius, facecolor=STRUCTURE, edgecolor=EDGE, lw=0.4, zorder=4))

    def _carriers(self) -> None:
        for carrier in self._trial.carriers:
            self._rectangle(carrier.home, AGV_SIZE[:2], (*carrier.colour[:3], 0.75), 2.5)
            self._rectangle(carrier.tray_surface, carrier.plate, TRAY, 3.2)
            out, back = world_path(carrier)
            for way in (out, back):
                self._line(way, ARROW, 1.2, ls="--", zorder=2.2)
            self._line_arrow(out)
            for direction, name in (((1.0, 0.0, 0.0), "x"), ((0.0, 1.0, 0.0), "y")):
                self._axis(carrier.tray_frame, direction, name)
        for tray in self._trial.layout.trays:
            for direction, name in (((1.0, 0.0, 0.0), "x"), ((0.0, 1.0, 0.0), "y")):
                self._axis(tray.tray_frame, direction, name)

    def _line_arrow(self, way: Sequence[Point]) -> None:
        """Draw an arrow in the first stretch of a path that leads away from the AGV."""
        (x0, y0), (x1, y1) = way[0], next((each for each in way[1:] if math.dist(each, way[0]) > 0.8), way[-1])
        length = math.dist((x0, y0), (x1, y1))
        if length:
            dx, dy = (x1 - x0) / length, (y1 - y0) / length
            self._arrow((x0 + 0.6 * dx, y0 + 0.6 * dy), (x0 + 0.9 * dx, y0 + 0.9 * dy), ARROW)

    def _axis(self, frame: Pose, direction: tuple[float, float, float], name: str) -> None:
        start, end, label = (frame.transform((d * direction[0], d * direction[1], 0.0))[:2] for d in (0.0, 0.18, 0.24))
        self._arrow(start, end, ARROW, 0.9)
        self._text(*label, name, 0.85, color=ARROW)

    def _arms(self) -> None:
        for arm in self._trial.arms:
            (low_x, low_y, _), (high_x, high_y, _) = arm.mount.ends
            middle = arm.pose.position[1], arm.pose.position[0]
            self._axes.add_patch(Circle(middle, _ARM, facecolor="#7fa8c9", edgecolor=RAIL, lw=1.2, zorder=8))
            if arm.mount.kind != "rail":
                x, y, _ = arm.pose.position
                self._label(arm.name, 1.0, [((x + sign * _ARM, y), (sign, 0)) for sign in (1, -1)], color=RAIL)
                continue
            self._line(((low_x, low_y), (high_x, high_y)), RAIL, 5.0, alpha=0.5, zorder=7)
            x, y, _ = arm.pose.transform((0.0, RAIL_LIMIT / 2, 0.0)) if arm.is_original else arm.mount.ends[1]
            of = "the arm" if len(self._trial.arms) == 1 else arm.name
            self._text(x, y, f"rail of {of}", color=RAIL, va="bottom", xytext=(0, 4))

    def _robots(self) -> None:
        for robot in self._trial.layout.robots:
            x, y, _ = robot.pose.position
            self._axes.add_patch(Circle((y, x), 0.2, facecolor="#7fa8c9", edgecolor=RAIL, lw=1.2, zorder=8))
            self._text(x, y, robot.name, color=RAIL, va="bottom", xytext=(0, 12))

    def _sensors(self) -> None:
        for sensor in self._trial.sensors:
            x, y, _ = sensor.pose.position
            if sensor.type == TYPE:
                view = [(px, py) for px, py, _ in corners(sensor.pose, looked_at(sensor.pose, self._surfaces))]
                patch = Polygon(
                    [point[::-1] for point in view], facecolor=SIGHT, alpha=0.14, edgecolor=SIGHT, lw=0.8, zorder=7
                )
                self._axes.add_patch(patch)
            else:
                end = sensor.pose.transform((0.3, 0.0, 0.0))
                self._line(((x, y), end[:2]), SIGHT, 1.2, zorder=7)
            self._axes.plot(y, x, "v", ms=4.5, color=SIGHT, zorder=9)
            places = edges(view, upper_first=False) if sensor.type == TYPE else [((x, y), (1, 0)), ((x, y), (-1, 0))]
            if sensor.type != TYPE and sensor.pose.rotate((1.0, 0.0, 0.0))[0] > 0.5:
                places.reverse()  # behind a sensor that looks up the map
            self._label(sensor.name.removeprefix("logical_"), 0.8, places, color=SIGHT)

    def _names(self) -> None:
        layout = self._trial.layout
        for bin_ in layout.bins:
            self._label(bin_.name, 1.15, edges(corners_of(bin_.pose, bin_.size)), weight="bold")
        for carrier in self._trial.carriers:
            self._text(*carrier.home.transform((0.0, -0.42, 0.0))[:2], carrier.name, 1.1, weight="bold")
        for tray in layout.trays:
            self._text(*tray.pose.transform((0.0, -0.3 * tray.size[1], 0.0))[:2], tray.name, 1.1, weight="bold")

    def _structure_names(self) -> None:
        """Write the name of each structure beside or above one of its ends; what carries an arm goes by its name."""
        seen = {f"{arm.name}_{arm.mount.kind}" for arm in self._trial.arms}
        for each in self._obstacles:
            if each.key.startswith("cell.structure") and each.name not in seen:
                seen.add(each.name)
                ends = (max((y, x) for x, y in each.corners), min((y, x) for x, y in each.corners))
                places = [((x, y), (0, side)) for (y, x), side in zip(ends, (1, -1), strict=True)]
                self._label(
                    each.name, 0.85, [*places, *(((x, y), (1, -side)) for (x, y), (_, side) in places)], color=MUTED
                )

    def _label(self, words: str, size: float, places: Iterable[tuple[Point, Point]], **more: Any) -> None:
        """Write words where they cover least, the first of several places.

        A place is a point and the direction in which the words are from it: x up, and y to the left.
        """
        height, width = self._size * size * _LINE / self._metre, self._size * size * _LETTER * len(words) / self._metre
        spans = []
        for (x, y), (up, side) in places:
            middle = (x + up * (height / 2 + _BESIDE), y + side * width / 2)
            spans.append(
                ((middle[0] - height / 2, middle[1] - width / 2), (middle[0] + height / 2, middle[1] + width / 2))
            )
        low, high = best = min(spans, key=lambda covered: sum(shared_area(covered, each) for each in self._taken))
        self._taken.append(best)
        x, y = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2
        if any(belt.covers(x, y) for belt in self._trial.layout.belts):
            more["color"] = ON_BELT
        self._text(x, y, words, size, **more)

    def _text(self, x: float, y: float, words: str, size: float = 1.0, **more: Any) -> None:
        """Write words around a point of the cell [m], `size` times as large as usual, `xytext` points away from it."""
        offset = more.pop("xytext", (0, 0))
        style = {"ha": "center", "va": "center", "color": INK, "zorder": 11, "annotation_clip": True, **more}
        self._axes.annotate(
            words, xy=(y, x), xytext=offset, textcoords="offset points", fontsize=self._size * size, **style
        )

    def _arrow(self, start: Iterable[float], end: Iterable[float], colour: str, width: float = 1.5) -> None:
        properties = {"arrowstyle": "-|>", "color": colour, "lw": width, "shrinkA": 0, "shrinkB": 0}
        (x0, y0), (x1, y1) = start, end
        self._axes.annotate("", xy=(y1, x1), xytext=(y0, x0), arrowprops=properties, zorder=8, annotation_clip=True)

    def _line(self, points: Iterable[Iterable[float]], colour: str, width: float, **more: Any) -> None:
        x, y = zip(*points, strict=True)
        self._axes.plot(y, x, color=colour, lw=width, **{"zorder": 8, "solid_capstyle": "round", **more})

    def _rectangle(self, middle: Pose, size: Sequence[float], face: Any, order: float, **more: Any) -> None:
        self._polygon(corners_of(middle, size), face, order, **more)

    def _polygon(self, points: Iterable[Point], face: Any, order: float, **more: Any) -> None:
        style = {"facecolor": face, "edgecolor": EDGE, "lw": 0.4, "zorder": order, **more}
        self._axes.add_patch(Polygon([(y, x) for x, y in points], **style))
