"""Placeholder until the packages are merged."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Installation:
    python: str
    environment: Mapping[str, str]


def find(environment: Mapping[str, str] | None = None) -> Installation:
    env = dict(os.environ if environment is None else environment)
    for name in ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "PYTHONHOME", "PYTHONPATH"):
        env.pop(name, None)
    return Installation(str(Path.home() / ".local/share/cellwright/ros2-jazzy/bin/python"), env)
