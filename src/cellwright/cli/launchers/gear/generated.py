"""The files that say what the launcher starts; they stand in for those that the original generated.

config.yaml   the configuration as it was given, files joined
gear.yaml     what it comes to: every part, sensor, order and drop region with its figures
gear.urdf     the robot description
gear.launch   starts the same cell again: `roslaunch DIR/gear.launch`
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from cellwright.cell.interface.urdf import robot_description
from cellwright.config.trial.gear2017 import Loaded
from cellwright.config.trial.resolved import resolved
from cellwright.config.trial.trial import Camera, Sensor
from cellwright.util.atomic_file import write_whole
from cellwright.util.errors import UsageError

CONFIG = "config.yaml"

_LAUNCH = """\
<?xml version="1.0"?>
<!-- The cell as gear.py started it. -->
<launch>
  <node name="ariac_node" pkg="osrf_gear" type="gear.py" output="screen" required="true"
        args="{options}-f $(dirname)/{config}" />
</launch>
"""


def generated(loaded: Loaded, text: str, *, competition: bool, verbose: bool = False) -> dict[str, str]:
    """The content of each file, by its name.

    Args:
        loaded: the configuration.
        text: the configuration as it was given.
        competition: whether the cell is in competition mode.
        verbose: whether the launcher was asked to say more.
    """
    options = ("" if competition else "--development-mode ") + ("--verbose " if verbose else "")
    return {
        CONFIG: text,
        "gear.yaml": resolved_text(loaded),
        "gear.urdf": robot_description(loaded.trial),
        "gear.launch": _LAUNCH.format(options=options, config=CONFIG),
    }


def resolved_text(loaded: Loaded) -> str:
    """What a configuration comes to, as YAML; poses in m and rad."""
    trial = loaded.trial
    facts: dict[str, Any] = {
        "name": trial.name,
        "arm": trial.has_arm,
        "sensors": {sensor.name: _sensor(sensor) for sensor in trial.sensors if not isinstance(sensor, Camera)},
        **resolved(loaded.figures),
    }
    return yaml.safe_dump(facts, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)


def _sensor(sensor: Sensor) -> dict[str, Any]:
    xyz, rpy = ([float(value) for value in vector] for vector in (sensor.pose.position, sensor.pose.rpy))
    return {"type": sensor.type, "xyz": xyz, "rpy": rpy}


def write(files: dict[str, str], folder: Path) -> None:
    """Write the files.

    Raises:
        UsageError: the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            write_whole(folder / name, content)
    except OSError as error:
        raise UsageError(f"{folder}: cannot be written: {error.strerror or error}") from None
