"""Reader of robot descriptions, small and independent of the code that writes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """A joint of the description."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Matrix
    axis: Matrix
    limit: Mapping[str, float]
    dynamics: Mapping[str, float]


def joints_of(text: str) -> list[Joint]:
    """Return every joint, in the order of the text."""
    return [_joint(element) for element in ElementTree.fromstring(text).iter("joint")]


def world_T(text: str, link: str, values: Mapping[str, float]) -> Matrix:
    """Return the pose of a link (4x4) at joint values [m, rad]; missing ones are 0."""
    by_child = {joint.child: joint for joint in joints_of(text)}
    found = np.eye(4)
    while link != "world":
        joint = by_child[link]
        found = joint.origin @ _motion(joint, values.get(joint.name, 0.0)) @ found
        link = joint.parent
    return found


def origin_of(element: Any) -> Matrix:
    """Return the 4x4 matrix of an element's `origin`, by the rule of the format: Rz(yaw) Ry(pitch) Rx(roll)."""
    origin = element.find("origin")
    roll, pitch, yaw = _numbers(origin.get("rpy"))
    matrix = np.eye(4)
    matrix[:3, :3] = turned((0, 0, 1), yaw) @ turned((0, 1, 0), pitch) @ turned((1, 0, 0), roll)
    matrix[:3, 3] = _numbers(origin.get("xyz"))
    return matrix


def turned(axis: Any, angle: float) -> Matrix:
    """Return the rotation by `angle` [rad] about a unit axis, by Rodrigues' formula."""
    x, y, z = axis
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=np.float64)
    matrix: Matrix = np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across
    return matrix


def _joint(element: Any) -> Joint:
    axis, limit, dynamics = element.find("axis"), element.find("limit"), element.find("dynamics")
    return Joint(
        element.get("name"),
        element.get("type"),
        element.find("parent").get("link"),
        element.find("child").get("link"),
        origin_of(element),
        np.array(_numbers("1 0 0" if axis is None else axis.get("xyz"))),
        {} if limit is None else {key: float(value) for key, value in limit.attrib.items()},
        {} if dynamics is None else {key: float(value) for key, value in dynamics.attrib.items()},
    )


def _motion(joint: Joint, value: float) -> Matrix:
    matrix = np.eye(4)
    if joint.kind == "prismatic":
        matrix[:3, 3] = joint.axis * value
    elif joint.kind == "revolute":
        matrix[:3, :3] = turned(joint.axis, value)
    return matrix


def _numbers(text: str) -> list[float]:
    return [float(each) for each in text.split()]
