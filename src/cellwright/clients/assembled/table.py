"""The index table in plain text: what numbers the joints and links of a robot have."""

from __future__ import annotations

import math
from typing import Iterable

from cellwright.clients.assembled.joints import JointInfo

_HEAD = ("index", "joint", "type", "link", "parent link", "from", "to")


def index_table(joints: Iterable[JointInfo]) -> str:
    """One line for each joint, fixed ones included; limits [rad; m] are empty where there are none."""
    rows = [_HEAD, *(_row(joint) for joint in joints)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEAD))]
    return "\n".join("  ".join(text.ljust(width) for text, width in zip(row, widths)).rstrip() for row in rows)


def _row(joint: JointInfo) -> tuple[str, ...]:
    bounds = [
        f"{value:.4g}" if joint.is_driven and math.isfinite(value) else "" for value in (joint.lower, joint.upper)
    ]
    return (str(joint.index), joint.name, joint.type, joint.link, joint.parent, *bounds)
