"""Reads the cameras of a robot configuration, by the file's own keys."""

from __future__ import annotations

import math
from typing import Any

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Items, Leaf, Node, Table, described
from cellwright.config.robot import config_keys
from cellwright.config.robot.config import Camera


def read_cameras(node: Node, reader: Reader) -> tuple[Camera, ...]:
    """The cameras; what they are used for decides which of their figures must be there."""
    if not isinstance(node, Items):
        reader.problems.error(node, f"must be a list of cameras, not {described(node)}")
        return ()
    cameras = [_camera(item, reader) for item in node.items]
    return tuple(camera for camera in cameras if camera is not None)


def plain(node: Node) -> Any:
    """A value as Python has it."""
    match node:
        case Table():
            return {str(entry.name): plain(entry.value) for entry in node.entries.values()}
        case Items():
            return [plain(item) for item in node.items]
    return node.value


def _camera(node: Node, reader: Reader) -> Camera | None:
    table = reader.table(node)
    name_node = reader.required(table, "name") if table else None
    if table is None or name_node is None:
        return None
    reader.ignored(table, config_keys.CAMERA)
    name = reader.name(name_node)
    figures = [entry.value for entry in table.entries.values() if entry.name in config_keys.CAMERA[1:]]
    for figure in figures:
        _check_finite(figure, reader)
    return Camera(name, plain(table)) if name is not None else None


def _check_finite(node: Node, reader: Reader) -> None:
    if isinstance(node, Items):
        for item in node.items:
            _check_finite(item, reader)
    elif isinstance(node, Leaf) and isinstance(node.value, float) and not math.isfinite(node.value):
        reader.problems.error(node, "must be a finite number")
