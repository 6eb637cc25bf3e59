"""Draws docs/images/cell-map.svg, the cell from above as it is simulated: python docs/images/draw_cell.py."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import mujoco
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from cellwright import Cell, load_trial
from cellwright.cell.model.arm import GRIPPER
from cellwright.clients.client import Client
from cellwright.config.arm import RAIL_LIMIT
from cellwright.engine.shapes import Role

HERE = Path(__file__).parent
LEFT, RIGHT, BOTTOM, TOP = 5.9, -4.75, -1.75, 2.1  # y [m] to the left, x [m] up
SCALE = 1.25  # inches to a metre
INK, MUTED = "#22313d", "#5c6b77"
ARM = "#7fa8c9"
COLOURS = {
    "|": "#e9b95a",
    "::tray": "#f4f1ea",
    "bin": "#bcd3e2",
    "agv": "#f0a860",
    "belt": "#4b5a55",
    "frame": "#8d979e",
}
"""By a part of a body's name; the first that fits."""


def outline(model: Any, data: Any, geom: int) -> np.ndarray:
    """Convex outline, n x 2 [m], of a shape seen from above: x, y in the world."""
    size, kind = model.geom_size[geom], model.geom_type[geom]
    turn = data.geom_xmat[geom].reshape(3, 3)
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.geom_dataid[geom]
        begin = model.mesh_vertadr[mesh]
        points = model.mesh_vert[begin : begin + model.mesh_vertnum[mesh]]
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        points = np.array(np.meshgrid(*[(-s, s) for s in size])).reshape(3, -1).T
    else:  # a cylinder or a capsule along z
        angle = np.linspace(0.0, 2.0 * np.pi, 48)
        ring = np.stack([size[0] * np.cos(angle), size[0] * np.sin(angle)], axis=1)
        points = np.concatenate([np.pad(ring, ((0, 0), (0, 1)), constant_values=end) for end in (-size[1], size[1])])
    return hull((points @ turn.T + data.geom_xpos[geom])[:, :2])


def hull(points: np.ndarray) -> np.ndarray:
    """The convex hull of points in the plane, n x 2, counterclockwise."""
    ordered = points[np.lexsort(points.T[::-1])]
    chains: list[np.ndarray] = []
    for walk in (ordered, ordered[::-1]):
        chain: list[np.ndarray] = []
        for point in walk:
            while len(chain) > 1 and np.linalg.det([chain[-1] - chain[-2], point - chain[-1]]) <= 1e-12:
                chain.pop()
            chain.append(point)
        chains += chain[:-1]
    return np.array(chains)


def colour(body: str) -> str:
    """Colour of a body; empty if it is not drawn."""
    return "" if "looks" in body else next((found for part, found in COLOURS.items() if part in body), "")


def text(axes: Any, x: float, y: float, words: str, size: float = 8.0, **more: Any) -> None:
    """Words around a point of the cell [m]."""
    axes.text(y, x, words, **{"fontsize": size, "ha": "center", "va": "center", "color": INK, "zorder": 9, **more})


def arrow(axes: Any, start: tuple[float, float], end: tuple[float, float], colour_: str, style: str = "-|>") -> None:
    """An arrow between two points x, y of the cell [m]."""
    properties = {"arrowstyle": style, "color": colour_, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=end[::-1], xytext=start[::-1], arrowprops=properties, zorder=8)


def draw() -> None:
    """The map."""
    cell = Cell(load_trial("lesson"))
    Client.in_process(cell).sleep(0.5)
    model, data = cell.simulation.model, cell.simulation.data
    mpl.rcParams.update({"font.family": "DejaVu Sans", "svg.fonttype": "none", "svg.hashsalt": "cell"})
    figure = Figure(figsize=((LEFT - RIGHT) * SCALE, (TOP - BOTTOM) * SCALE))
    axes = figure.add_axes((0.035, 0.11, 0.96, 0.88))
    axes.set(xlim=(LEFT, RIGHT), ylim=(BOTTOM, TOP), aspect="equal")
    axes.grid(color="#e2e7ea", lw=0.6)
    axes.set_axisbelow(True)
    axes.set_xlabel("y [m]", color=MUTED)
    axes.set_ylabel("x [m]", color=MUTED)
    axes.tick_params(colors=MUTED)
    for spine in axes.spines.values():
        spine.set_visible(False)

    for geom in sorted(range(model.ngeom), key=lambda each: float(data.geom_xpos[each][2])):
        body = str(model.body(model.geom_bodyid[geom]).name)
        is_arm = model.body_rootid[model.geom_bodyid[geom]] == model.body_rootid[model.body(GRIPPER).id]
        face = ARM if is_arm else colour(body)
        if face and model.geom_group[geom] in (int(Role.BOTH), int(Role.SOLID)):
            points = outline(model, data, geom)[:, ::-1]
            axes.add_patch(Polygon(points, facecolor=face, edgecolor="#53626d", lw=0.4, zorder=3 + 2 * is_arm))

    layout = cell.trial.layout
    for each in layout.bins:
        x, y = each.centre
        text(axes, x + 0.17, y, each.name.replace("bin", "bin "), 10, weight="bold")
        corner = each.corner
        for along in ((0.15, 0.0, 0.0), (0.0, 0.15, 0.0)):
            arrow(axes, corner.position[:2], corner.transform(along)[:2], "#a03020")
    for agv in layout.carriers:
        x, y, _ = agv.home.position
        text(axes, x + 0.48, y, f"AGV {agv.number}", 10)
        tray = agv.home @ agv.home_T_tray
        for axis, name in (((1.0, 0.0, 0.0), "x"), ((0.0, 1.0, 0.0), "y")):
            ahead = tray.rotate(axis)
            tip, letter = (
                (tray.position[0] + far * ahead[0], tray.position[1] + far * ahead[1]) for far in (0.22, 0.29)
            )
            arrow(axes, tray.position[:2], tip, "#a03020")
            text(axes, *letter, name, 8, color="#a03020")
    ends = [layout.rail.transform((0.0, y, 0.0))[:2] for y in (-RAIL_LIMIT, RAIL_LIMIT)]
    arrow(axes, *ends, "#1f5f8b", "<|-|>")
    x, y, _ = layout.rail.transform((0.23, -1.6, 0.0))
    text(axes, x, y, f"rail, -{RAIL_LIMIT:g} to {RAIL_LIMIT:g} m", 8, color="#1f5f8b")
    for belt in layout.belts:
        x, begin, _ = belt.spawn.position
        middle = belt.centre.position[0]
        arrow(axes, (middle, begin - 2.8), (middle, begin - 3.8), "white")
        text(axes, middle + 0.15, begin - 3.3, f"belt, {belt.speed:g} m/s", 8, color="white")
        axes.plot(begin, x, "o", ms=5, color="white", zorder=8)
        text(axes, x + 0.18, begin, "parts\nappear here", 7.5, color="white")
        if belt.wall is not None:
            x, end, _ = belt.wall.position
            half = belt.wall_size[0] / 2
            axes.plot((end, end), (x - half, x + half), color="#a03020", lw=3, zorder=8)
            text(axes, x + 0.66, end, "parts leave here", 8, color="#a03020")
    for x, y, words in (
        (-0.7, 1.95, "two rows of posts,\nbars at 2 m"),
        (1.86, 0.0, "fence with posts, bar at 0.95 m"),
    ):
        text(axes, x, y, words, 8, color=MUTED)
    figure.savefig(HERE / "cell-map.svg", metadata={"Date": None})


draw()
