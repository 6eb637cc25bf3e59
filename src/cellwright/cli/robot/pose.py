"""A posture as it is given on the command line: JSON, positions by joint."""

from __future__ import annotations

import json
import math
from typing import Any

from cellwright.cli.options import refuse
from cellwright.config.robot.model import RobotModel
from cellwright.util.errors import UnknownNameError

_EXAMPLE = """give positions by joint, such as '{"elbow": 1.57}'"""
_MOST = 1e6  # [rad; m]; what lies beyond is a slip, and turns lose their meaning in rounding


def read_pose(text: str, robot: RobotModel) -> dict[str, float]:
    """The positions of joints by name [rad; m].

    Raises:
        UsageError: it is no posture of this robot.
    """
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        why = f"{error.msg}, at character {error.pos + 1}" if isinstance(error, json.JSONDecodeError) else "no JSON"
        refuse(f"--pose: no valid JSON ({why}); {_EXAMPLE}")
    if not isinstance(found, dict):
        refuse(f"--pose: no posture; {_EXAMPLE}")
    return {name: _position(name, value, robot) for name, value in found.items()}


def _position(name: str, value: Any, robot: RobotModel) -> float:
    driven = [joint.name for joint in robot.driven]
    if name not in driven:
        if name in robot.joint_indices:
            refuse(f"--pose: {name} is {robot.joint(name).type}, and has no position (known: {', '.join(driven)})")
        refuse(f"--pose: {UnknownNameError('joint', name, driven).sentence()}")
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or abs(value) > _MOST:
        refuse(f"--pose: {name}: must be a finite number [rad; m], not {json.dumps(value)[:40]}")
    return float(value)
