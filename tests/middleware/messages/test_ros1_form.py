import json
import subprocess
from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.ros1_form import CAMERA_INFO, HEADER, OTHERWISE_IN_ROS1, RANGE, SEPARATOR
from cellwright.util.errors import UnknownNameError, UsageError
from tests.conftest import load_cases
from tests.support.waiting import TIMEOUT


@pytest.mark.parametrize("case", load_cases("md5_cases.json"), ids=lambda case: case["name"])
def test_md5_of_competition_types_matches_original(case: dict[str, Any]) -> None:
    assert TYPES.md5(case["name"])[: len(case["md5"])] == case["md5"]


def test_md5_cases_cover_every_competition_type() -> None:
    named = {case["name"] for case in load_cases("md5_cases.json")}
    ours = {name.replace("/msg/", "/").replace("/srv/", "/") for name in TYPES.sources if name.startswith("osrf_gear/")}
    assert ours <= named


@pytest.mark.slow
def test_md5_of_standard_types_matches_noetic() -> None:
    noetic = get_typestore(Stores.ROS1_NOETIC)
    shared = noetic.fielddefs.keys() & TYPES.ros1.store.fielddefs.keys()
    left_out = ("Marker", "NavSat", "Disparity")  # these, and what holds one of them
    names = [name for name in shared if not any(word in name for word in left_out)]
    assert len(names) > 100
    assert [name for name in names if noetic.generate_msgdef(name)[1] != TYPES.md5(name)] == []


def test_types_excluded_from_ros1_are_those_with_other_fields() -> None:
    noetic = get_typestore(Stores.ROS1_NOETIC)
    store = TYPES.ros2
    shared = noetic.fielddefs.keys() & store.fielddefs.keys()
    changed = {name for name in shared if noetic.fielddefs[name] != store.fielddefs[name]}
    assert changed == OTHERWISE_IN_ROS1 | {HEADER, RANGE, CAMERA_INFO}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("std_srvs/Trigger", "937c9679a518e3a18d831e57125ea522"),
        ("std_srvs/srv/Empty", "d41d8cd98f00b204e9800998ecf8427e"),
        ("cellwright_msgs/Step", "7e9a558e71e0b64a2a795a7415a8d616"),
        ("std_msgs/Header", "2176decaecbce78abc3b96ef049fabed"),
        ("std_msgs/msg/String", "992ce8a1687cec8c8bd883ec73ca41d1"),
        ("sensor_msgs/Range", "c005c34273dc426c67a020a87bc24148"),
        ("sensor_msgs/CameraInfo", "c9a58c1b0b154e0e6da7578cb991d214"),
        ("rosgraph_msgs/Clock", "a9c97c1d230cfc112e270351a944ee47"),
    ],
)
def test_md5_of_well_known_types_matches(name: str, expected: str) -> None:
    assert TYPES.md5(name) == expected


def test_definition_contains_nested_types() -> None:
    text = TYPES.definition("osrf_gear/Order")
    assert text.startswith(TYPES.sources["osrf_gear/msg/Order"])
    assert [line for line in text.splitlines() if line.startswith("MSG: ")] == [
        "MSG: osrf_gear/Kit",
        "MSG: osrf_gear/KitObject",
        "MSG: geometry_msgs/Pose",
        "MSG: geometry_msgs/Point",
        "MSG: geometry_msgs/Quaternion",
    ]


def test_definition_matches_form_of_ros1() -> None:
    assert "\nuint32 seq\n" in TYPES.definition("osrf_gear/Proximity")
    assert "variance" not in TYPES.definition("sensor_msgs/Range")


def test_md5_of_unknown_or_unsupported_type_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="did you mean osrf_gear/Order"):
        TYPES.md5("osrf_gear/Ordre")
    with pytest.raises(UsageError, match="different fields in ROS 1"):
        TYPES.md5("visualization_msgs/MarkerArray")
    with pytest.raises(UsageError, match="not a type name"):
        TYPES.md5("Order")


def test_sources_match_definition_files() -> None:
    assert "string order_id" in TYPES.sources["osrf_gear/msg/Order"]
    assert all(text.startswith("# ") for text in TYPES.sources.values())
    assert TYPES.message("osrf_gear/Order").__msgtype__ == "osrf_gear/msg/Order"


def test_texts_of_ros1_have_the_checksums_of_the_types() -> None:
    store = Typestore()
    built_in = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
    store.fielddefs |= {name: TYPES.ros1.store.fielddefs[name] for name in built_in}
    for name, text in TYPES.ros1.texts().items():
        store.fielddefs |= get_types_from_msg(text, name)
    for name in TYPES.ros1.texts():
        assert store.generate_msgdef(name, ros_version=1)[1] == TYPES.md5(name), name


def test_definition_has_each_text_once() -> None:
    assert len(TYPES.ros1.texts()) > 40
    for name, text in TYPES.ros1.texts().items():
        first, *embedded = TYPES.definition(name).split(f"{SEPARATOR}\nMSG: ")
        names = [section.partition("\n")[0] for section in embedded]
        assert first.rstrip("\n") == text.rstrip("\n")
        assert len(names) == len(set(names))


ALL_TEXTS = """
import importlib, json, sys
found = {}
for name in json.load(sys.stdin):
    package, _, last = name.split("/")
    found[name] = getattr(importlib.import_module(package + ".msg"), last)._full_text
json.dump(found, sys.stdout)
"""


@pytest.mark.ros1
def test_definition_is_word_for_word_that_of_ros1() -> None:
    """Those of Cellwright's own packages are compared by `rosbag check`, in the tests of bags."""
    own = ("cellwright_msgs", "control_msgs", "controller_manager_msgs", "osrf_gear")
    names = [name for name in TYPES.ros1.texts() if name.partition("/")[0] not in own]
    ran = subprocess.run(
        ["/usr/bin/python3", "-c", ALL_TEXTS],
        input=json.dumps(names),
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=True,
    )
    assert {name: text.strip() for name, text in json.loads(ran.stdout).items()} == {
        name: TYPES.definition(name).strip() for name in names
    }
