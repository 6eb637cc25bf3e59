"""Xacro files: any macros and expressions give a robot or a refusal, without side effects."""

from __future__ import annotations

import random
import tempfile
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

from cellwright.config.robot import urdf_file as xacro_file
from cellwright.config.robot.urdf import read_urdf
from cellwright.util.errors import DescriptionError
from fuzz import xml_trees
from fuzz.targets.robot_file import NAMES, TAGS
from fuzz.verdict import check_lines, check_refusal

MAX_SIZE = 3000
_XACRO = "{http://www.ros.org/wiki/xacro}"
_TAGS = (
    *TAGS,
    *(_XACRO + name for name in ("macro", "property", "if", "unless", "include", "arg", "insert_block", "m")),
)
_NAMES = (*NAMES, "params", "default", "scope", "filename", "ns")
WORDS = (
    *(
        "xacro:macro",
        "xacro:property",
        "xacro:include",
        "xacro:if",
        "xacro:arg",
        "params",
        "value",
        "${",
        "}",
        "$(find x)",
    ),
    *(
        "$(arg a)",
        "$(eval 1)",
        "$(optenv A)",
        "lambda x:",
        "for x in",
        "[0]*9",
        "**",
        "range(",
        "load_yaml(",
        ".format",
    ),
)
_FOLDER = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-"))
_PATH = _FOLDER / "robot.xacro"
MAX_EXPANSION_TIME = 3.0
"""Bound of one expansion [s]: shorter than users', so that a slow input costs a search less."""


def seeds() -> Iterator[bytes]:
    """Yield robots with every feature of xacro."""
    for inside in (
        '<xacro:property name="p" value="${2*pi}"/><link name="l${p}"/>',
        '<xacro:macro name="m" params="a *c"><link/></xacro:macro><xacro:m a="x"><link name="y"/></xacro:m>',
        '<xacro:arg name="a" default="1"/><xacro:if value="$(arg a)"><link name="a"/></xacro:if>',
        '<xacro:unless value="${1 == 2}"><link name="${[x for x in range(3)][0]}"/></xacro:unless>',
        '<xacro:include filename="$(find here)/other.xacro"/><link name="${\'a\'.upper()}"/>',
    ):
        yield f'<robot name="r" xmlns:xacro="{_XACRO[1:-1]}">{inside}</robot>'.encode()


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return another robot."""
    return xml_trees.mutate(data, chance, _TAGS, _NAMES)


def attempt(data: bytes) -> None:
    """Expand and read the file, in a folder that must stay unchanged."""
    _PATH.write_bytes(data)
    warnings: list[str] = []
    try:
        with patch.object(xacro_file, "MAX_EXPANSION_TIME", MAX_EXPANSION_TIME):
            read_urdf(_PATH, warn=warnings.append)
    except DescriptionError as error:
        check_refusal(error, str(_PATH))
    check_lines(warnings, [str(_PATH)])
    if [path.name for path in _FOLDER.iterdir()] != [_PATH.name]:
        raise RuntimeError("a file that was not there before")
