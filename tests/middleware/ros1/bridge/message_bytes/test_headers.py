"""Header detection, compared with the definitions themselves."""

import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.ros1.bridge.message_bytes import has_header


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("sensor_msgs/JointState", True),
        ("sensor_msgs/Range", True),  # constants come first
        ("osrf_gear/Proximity", True),
        ("actionlib_msgs/GoalStatusArray", True),
        ("std_msgs/Header", False),
        ("std_msgs/String", False),
        ("tf2_msgs/TFMessage", False),  # it is in the transforms
        ("actionlib_msgs/GoalID", False),
        ("osrf_gear/Order", False),
        ("rosgraph_msgs/Clock", False),
    ],
)
def test_has_header_of_contract_types(name: str, expected: bool) -> None:
    assert has_header(TYPES.definition(name)) is expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", False),
        ("# said first\n\n  Header   header # with a word\nint8 x", True),
        ("Header head", False),
        ("int8 x\nHeader header", False),
        ("string NAME=Header header\nHeader header", True),
        ("other_msgs/Header header", False),
    ],
)
def test_has_header_of_definition_texts(text: str, expected: bool) -> None:
    assert has_header(text) is expected
