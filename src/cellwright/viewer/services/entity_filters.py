"""Filters of entities: names by POSIX expressions, places by the shapes that overlap bounds."""

from __future__ import annotations

import re
import string
from collections.abc import Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.entities import geom_box
from cellwright.util.pose import Vector3
from cellwright.viewer.services.simulation_requests import (
    BOX,
    FAILED,
    HULL,
    SPHERE,
    UNSUPPORTED,
    BoundsFields,
    RequestError,
)

MAX_FILTER_LENGTH, MAX_REPEATS, MAX_HULL_POINTS = 200, 3, 32
"""Limits of a filter: length and repetitions of its expression, points of a convex hull."""

POSIX_CLASSES = MappingProxyType(
    {
        "alpha": string.ascii_letters,
        "alnum": string.ascii_letters + string.digits,
        "blank": " \t",
        "cntrl": "".join(map(chr, (*range(32), 127))),
        "digit": string.digits,
        "graph": "".join(map(chr, range(33, 127))),
        "lower": string.ascii_lowercase,
        "print": "".join(map(chr, range(32, 127))),
        "punct": string.punctuation,
        "space": " \t\n\r\f\v",
        "upper": string.ascii_uppercase,
        "xdigit": string.hexdigits,
    }
)
"""Characters of the classes in a bracket expression, such as `[[:alpha:]]`, in POSIX's own locale."""

THINNEST = 1e-6
"""Smallest extent [m] of bounds, so that a point or an area overlaps what it touches."""

_PIECES = re.compile(r"\[\^?\]?(?:\[:[^\]]*:\]|[^\]])*\]|\\.|[^\[\\]+|.", re.DOTALL)
"""Pieces of an expression: bracket expressions, escaped characters, and the rest."""

_IN_BRACKETS = re.compile(r"\[:([a-z]+):\]|(\[[.=:])|(.)-(.)|(.)", re.DOTALL)
"""Pieces of a bracket expression: classes, what is not supported, ranges, and characters."""


def expression(text: str) -> re.Pattern[str]:
    """Return a filter, a POSIX extended expression, for a search in names.

    Raises:
        RequestError: the expression is wrong, or a search could take long.
    """
    pieces = _PIECES.findall(text)
    plain = "".join("x" if len(each) > 1 and each[0] in "[\\" else each for each in pieces)
    repeats = len(re.findall(r"[*+?{]", plain))
    has_references = any(re.fullmatch(r"\\\d", each) for each in pieces)
    if len(text) > MAX_FILTER_LENGTH or repeats > MAX_REPEATS or has_references or re.search(r"\)[*+?{]", plain):
        raise RequestError(
            FAILED,
            f"filter: at most {MAX_FILTER_LENGTH} characters and {MAX_REPEATS} repetitions, none of a group "
            f"(got {text!r:.60}); use a simpler expression",
        )
    try:
        return re.compile("".join(_brackets(each) if each[0] == "[" and len(each) > 1 else each for each in pieces))
    except re.error as error:
        raise RequestError(FAILED, f"filter: {error} (got {text!r:.60})") from None


def overlapping(
    bounds: BoundsFields, model: mujoco.MjModel, data: mujoco.MjData, shapes: Mapping[str, tuple[int, ...] | Vector3]
) -> set[str]:
    """Return the names of those whose shapes overlap bounds in the world frame.

    The engine itself measures the distances, in a model of the bounds and of the shapes near them.

    Args:
        bounds: box, sphere or hull.
        model: the engine's model.
        data: its state, with the poses of the shapes.
        shapes: ids of the geoms by name; the origin [m] of what has no shape.

    Raises:
        RequestError: the bounds have an unknown type, or the wrong number of points.
    """
    spec = mujoco.MjSpec()
    lower, upper = _add_region(spec, bounds)
    near: list[str] = []
    for name, shape in shapes.items():
        if shape and isinstance(shape[0], float):
            near.append(name)
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[THINNEST, 0.0, 0.0], pos=shape)
            continue
        for geom in map(int, shape):
            if _is_near(model, data, geom, lower, upper):
                near.append(name)
                _copy_geom(spec, model, data, geom)
    try:
        scratch = spec.compile()
    except ValueError:  # the engine finds no hull
        raise RequestError(FAILED, "bounds: the points of a hull must not lie on a line") from None
    placed = mujoco.MjData(scratch)
    mujoco.mj_kinematics(scratch, placed)
    distance = partial(mujoco.mj_geomDistance, scratch, placed, 0)
    return {name for index, name in enumerate(near, 1) if distance(index, THINNEST, None) <= 0.0}


def _brackets(text: str) -> str:
    """Return a POSIX bracket expression in Python's form: a backslash and a bracket stand for themselves."""
    is_inverted = text.startswith("[^")
    found = []
    for name, special, first, last, single in _IN_BRACKETS.findall(text[1 + is_inverted : -1]):
        if special or (name and name not in POSIX_CLASSES):
            raise RequestError(
                FAILED, f"filter: unknown class in brackets (got {text!r:.60}); use {', '.join(POSIX_CLASSES)}"
            )
        found.append(f"{re.escape(first)}-{re.escape(last)}" if first else re.escape(POSIX_CLASSES.get(name, single)))
    return f"[{'^' * is_inverted}{''.join(found)}]"


def _add_region(spec: mujoco.MjSpec, bounds: BoundsFields) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Add bounds to a model; return their lower and upper corner [m]."""
    points = np.array([each.values for each in bounds.points], dtype=np.float64).reshape(-1, 3)
    if bounds.type not in (BOX, HULL, SPHERE):
        raise RequestError(UNSUPPORTED, f"bounds: type must be from 1 to 3 (got {bounds.type})")
    if not np.isfinite(points).all():
        raise RequestError(FAILED, "bounds: points must be finite")
    lower, upper = points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)
    if bounds.type == BOX and len(points) == 2:
        half = np.maximum((upper - lower) / 2, THINNEST)
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=(lower + upper) / 2)
        return lower, upper
    if bounds.type == SPHERE and len(points) == 2 and points[1][0] >= 0.0:
        radius = max(points[1][0], THINNEST)
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0.0, 0.0], pos=points[0])
        return points[0] - radius, points[0] + radius
    if bounds.type == HULL and 3 <= len(points) <= MAX_HULL_POINTS:
        across = np.linalg.svd(points - points.mean(axis=0))[2][2] * THINNEST  # a flat hull gets some thickness
        spec.add_mesh(name="region", uservert=np.concatenate([points - across, points + across]).ravel())
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="region")
        return lower, upper
    raise RequestError(
        FAILED,
        "bounds must be a box of 2 points, a sphere of 2 points with a radius from 0, or a hull of 3 to "
        f"{MAX_HULL_POINTS} points (got type {bounds.type} with {len(points)})",
    )


def _is_near(model: mujoco.MjModel, data: mujoco.MjData, geom: int, lower: Any, upper: Any) -> bool:
    """Return whether the box of a geom along the world's axes overlaps another box."""
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:  # it has no end
        return True
    (box_lower, box_upper) = geom_box(model, data, geom)
    return bool((box_lower <= upper + THINNEST).all() and (box_upper >= lower - THINNEST).all())


def _copy_geom(spec: mujoco.MjSpec, model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> None:
    """Add a geom of another model, at its pose in the world."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, data.geom_xmat[geom])
    more: dict[str, Any] = {}
    if (mesh := int(model.geom_dataid[geom])) >= 0:
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        more["meshname"] = f"{geom}"
        spec.add_mesh(name=f"{geom}", uservert=model.mesh_vert[first : first + count].ravel())
    shape = mujoco.mjtGeom(model.geom_type[geom])
    size = model.geom_size[geom] if not more else np.zeros(3)
    spec.worldbody.add_geom(type=shape, size=size, pos=data.geom_xpos[geom], quat=quaternion, **more)
