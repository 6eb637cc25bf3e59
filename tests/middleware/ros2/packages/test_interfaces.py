"""Interfaces as built: the Python of ROS 2 loads each, and each has its recorded type hash.

Types of ROS 2 match by name and hash; with another hash nothing arrives, and no error says so. After a change of a
definition, `CELLWRIGHT_WRITE_HASHES=1 pytest tests/middleware/ros2/packages/test_interfaces.py` records the hashes.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
from functools import cache
from pathlib import Path

import pytest
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from cellwright.middleware.ros2.host.installation import Installation
from cellwright.middleware.ros2.packages.contents import definitions, interface_packages
from tests.ros2.requirement import installation, installation_of
from tests.support.waiting import TIMEOUT

RECORDED = Path(__file__).parents[3] / "data" / "ros2_type_hashes.json"

OTHERWISE_IN_ROSBAGS = "service_msgs/msg/ServiceEventInfo"
"""A type with a field of type `char`, which rosbags takes for `uint8`."""

LOADED = """
import importlib, json, sys
from pathlib import Path
from ament_index_python.packages import get_package_share_directory
from rclpy.type_support import check_for_type_support

found = {"hashes": {}, "constants": {}}
for package in sys.argv[1:]:
    for path in sorted(Path(get_package_share_directory(package)).glob("*/*")):
        kind = path.parent.name
        if path.suffix == ".json" and kind in ("msg", "srv", "action"):
            for each in json.loads(path.read_text())["type_hashes"]:
                found["hashes"][each["type_name"]] = each["hash_string"]
        elif path.suffix == f".{kind}":
            loaded = getattr(importlib.import_module(f"{package}.{kind}"), path.stem)
            check_for_type_support(loaded)
            parts = {"msg": [loaded], "srv": ["Request", "Response"], "action": ["Goal", "Result", "Feedback"]}[kind]
            constants = found["constants"][f"{package}/{kind}/{path.stem}"] = {}
            for part in parts:
                part = getattr(loaded, part) if isinstance(part, str) else part
                part()
                named = vars(part).items()
                constants.update({name: value for name, value in named if name.isupper() and type(value) is int})
print(json.dumps(found))
"""

OFFERED = """
import importlib, sys
import rclpy

rclpy.init()
node = rclpy.create_node("hashes")
for name in sys.argv[1:]:
    package, kind, last = name.split("/")
    node.create_publisher(getattr(importlib.import_module(f"{package}.{kind}"), last), f"/{package}/{last}", 1)
    (offered,) = node.get_publishers_info_by_topic(f"/{package}/{last}")
    print(offered.topic_type_hash)
node.destroy_node()
rclpy.try_shutdown()
"""


def run(program: str, *arguments: str, under: Installation | None = None) -> str:
    """Run a program with the Python of ROS 2, alone on this machine, and return its output."""
    found = under or installation()
    assert found is not None
    alone = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "ROS_DOMAIN_ID": "83"}
    ran = subprocess.run(
        [found.python, "-c", program, *arguments],
        env={**found.environment, **alone},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


@cache
def loaded(under: str = "") -> tuple[dict[str, str], dict[str, dict[str, int]]]:
    """Return the hash of each type, and the constants of each interface that could be loaded."""
    answer = json.loads(run(LOADED, *interface_packages(), under=installation_of(under) if under else None))
    return answer["hashes"], answer["constants"]


@pytest.mark.ros2
def test_each_interface_is_loaded() -> None:
    expected = {f"{package}/{path.partition('.')[0]}" for package, texts in definitions().items() for path in texts}
    assert set(loaded()[1]) == expected


@pytest.mark.ros2
def test_type_hashes_are_the_recorded_ones() -> None:
    hashes = loaded()[0]
    if os.environ.get("CELLWRIGHT_WRITE_HASHES"):
        RECORDED.write_text(json.dumps(hashes, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    assert hashes == json.loads(RECORDED.read_text(encoding="utf-8"))


@pytest.mark.ros2
def test_publishers_offer_recorded_hashes() -> None:
    names = ["osrf_gear/msg/Order", "control_msgs/msg/JointTrajectoryControllerState", "tf2_msgs/msg/TFMessage"]
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    assert run(OFFERED, *names).split() == [recorded[name] for name in names]


def test_recorded_hashes_are_those_of_rosbags() -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    messages: Typesdict = {}
    for package, texts in definitions().items():
        for path, text in texts.items():
            if path.endswith(".msg"):
                messages |= get_types_from_msg(text, f"{package}/{path.removesuffix('.msg')}")
    store.register({name: fields for name, fields in messages.items() if name not in store.fielddefs})
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    known = {name for name in recorded if "/msg/" in name and name in store.fielddefs} - {OTHERWISE_IN_ROSBAGS}
    assert {name: store.hash_rihs01(name) for name in known} == {name: recorded[name] for name in known}
    assert set(messages) <= known


def test_hashes_are_of_one_form() -> None:
    recorded = json.loads(RECORDED.read_text(encoding="utf-8"))
    assert all(re.fullmatch(r"RIHS01_[0-9a-f]{64}", value) for value in recorded.values())
    assert {"std_msgs/msg/Header", "geometry_msgs/msg/Pose", "builtin_interfaces/msg/Time"} <= set(recorded)
