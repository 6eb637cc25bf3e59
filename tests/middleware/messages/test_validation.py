import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES, osrf_gear
from cellwright.middleware.messages.conversions import header, joint_trajectory, pose_message, trajectory_point
from cellwright.middleware.messages.osrf_gear import (
    ConveyorBeltState,
    Kit,
    KitObject,
    Order,
    Proximity,
    VacuumGripperControlRequest,
)
from cellwright.middleware.messages.standard import Duration, JointTrajectory, JointTrajectoryPoint, Time
from cellwright.util.errors import MessageError, RejectedCommandError, UnknownNameError
from cellwright.util.pose import Pose
from tests.middleware.messages.random_messages import same

wrong: Any = SimpleNamespace(**vars(osrf_gear), Time=Time)
"""The classes, for calls that a type checker rejects."""


def point(positions: Any) -> JointTrajectoryPoint:
    return JointTrajectoryPoint(positions, [], (), np.array([]), Duration(1, 0))  # type: ignore[arg-type]


def test_valid_message_is_returned_itself() -> None:
    order = Order("order_0", [Kit("order_0_kit_0", [KitObject("gear_part", pose_message(Pose()))])])
    assert TYPES.checked(order) is order


@pytest.mark.parametrize("positions", [[0.0, 1.0], (0, 1), np.array([0.0, 1.0], dtype=np.float32), [np.float64(0), 1]])
def test_sequence_of_numbers_becomes_read_only_array(positions: Any) -> None:
    given_message = JointTrajectory(header(), ["a", "b"], [point(positions)])
    taken = TYPES.checked(given_message)
    assert taken is not given_message
    assert same(taken, joint_trajectory(["a", "b"], [trajectory_point([0, 1], time_from_start=10**9)]))
    assert given_message.points[0].positions is positions
    assert not taken.points[0].positions.flags.writeable


def test_tuples_become_lists_and_numpy_scalars_plain_numbers() -> None:
    taken = TYPES.checked(JointTrajectory(header(), ("a",), ()))  # type: ignore[arg-type]
    assert (taken.joint_names, taken.points) == (["a"], [])
    time: Any = TYPES.checked(Time(np.int64(3), np.uint8(4)))  # type: ignore[arg-type]
    assert (type(time.sec), type(time.nanosec)) == (int, int)
    request = TYPES.checked(VacuumGripperControlRequest(np.bool_(True)))  # type: ignore[arg-type]
    assert request.enable is True
    assert type(TYPES.checked(ConveyorBeltState(100)).power) is float


def test_float32_field_is_rounded_to_single_precision() -> None:
    taken = TYPES.checked(Proximity(header(), False, 0.025, float("inf")))
    assert (taken.min_range, taken.max_range) == (float(np.float32(0.025)), float("inf"))
    assert TYPES.checked(taken) is taken


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (wrong.Order(5), "osrf_gear/Order.order_id must be a string, not 5"),
        (wrong.Order("\ud800"), "osrf_gear/Order.order_id cannot be encoded as UTF-8"),
        (wrong.Order("", [None]), "osrf_gear/Order.kits[0] must be of type osrf_gear/Kit, not None"),
        (
            wrong.Order("", [wrong.Kit("", [wrong.KitObject("", "here")])]),
            "kits[0].objects[0].pose must be of type geometry_msgs/Pose",
        ),
        (wrong.Order("", wrong.Kit()), "osrf_gear/Order.kits must be a list, not osrf_gear/Kit"),
        (wrong.Order(None), "order_id must be a string, not None"),
        (wrong.AGVControlRequest(b"kit"), "kit_type must be a string, not bytes"),
        (wrong.ConveyorBeltControlRequest(100.0), "state must be of type osrf_gear/ConveyorBeltState, not 100.0"),
        (wrong.ConveyorBeltState("100"), "power must be a number, not '100'"),
        (wrong.ConveyorBeltState(True), "power must be a number, not True"),
        (wrong.ConveyorBeltState(10**400), "power must fit into float64"),
        (Proximity(header(), False, 1e39, 0.0), "min_range must fit into float32, not 1e+39"),
        (wrong.VacuumGripperControlRequest(1), "enable must be true or false, not 1"),
        (wrong.Time(2**31, 0), "sec must be from -2147483648 to 2147483647, not 2147483648"),
        (wrong.Time(0, -1), "nanosec must be from 0 to 4294967295, not -1"),
        (wrong.Time(1.0, 0), "sec must be a whole number, not 1.0"),
        (wrong.Time(True, 0), "sec must be a whole number, not True"),
        (point("12"), "positions must be a sequence of float64, not '12'"),
        (point([1.0, "x"]), "positions[1] must be a number, not 'x'"),
        (point([[1.0]]), "positions[0] must be a number, not list"),
        (point(np.zeros((2, 2))), "positions must be a sequence of float64, not ndarray"),
        (point(1.0), "positions must be a sequence of float64, not 1.0"),
        (wrong.Order("x" * 3, ["y" * 100]), "not '" + "y" * 56 + "..."),
    ],
)
def test_invalid_field_is_named_in_error(message: Any, said: str) -> None:
    with pytest.raises(MessageError, match=re.escape(said)):
        TYPES.checked(message)


def test_message_error_is_rejected_command_error() -> None:
    assert issubclass(MessageError, RejectedCommandError)


def test_fixed_length_byte_array_is_validated() -> None:
    uuid: Any = TYPES.message("unique_identifier_msgs/UUID")
    taken = TYPES.checked(uuid(bytes(range(16))))
    assert taken.uuid.dtype == np.uint8
    assert taken.uuid.tolist() == list(range(16))
    assert TYPES.checked(taken) is taken
    with pytest.raises(MessageError, match="must have 16 entries, not 3"):
        TYPES.checked(uuid([1, 2, 3]))
    with pytest.raises(MessageError, match=r"uuid\[0\] must be from 0 to 255, not 256"):
        TYPES.checked(uuid([256] + [0] * 15))


def test_bounded_sequence_beyond_limit_is_refused() -> None:
    # the only bounded types of the standard: a shape's dimensions and its polygon
    primitive: Any = TYPES.message("shape_msgs/SolidPrimitive")
    polygon: Any = TYPES.message("geometry_msgs/Polygon")
    TYPES.checked(primitive(1, [1.0, 2.0, 3.0], polygon([])))
    with pytest.raises(MessageError, match="dimensions may have at most 3 entries, not 4"):
        TYPES.checked(primitive(1, [1.0, 2.0, 3.0, 4.0], polygon([])))


@given(st.lists(st.floats(allow_nan=False)))
def test_finite_numbers_survive_validation(values: list[float]) -> None:
    assert TYPES.checked(point(values)).positions.tolist() == values


@given(
    st.lists(st.text(st.characters(min_codepoint=0x60, max_codepoint=0xDFFF), max_size=3) | st.none() | st.integers())
)
def test_first_invalid_entry_of_list_is_named_in_error(names: list[Any]) -> None:
    message = JointTrajectory(header(), names, [])
    wrong_ones = [
        place
        for place, name in enumerate(names)
        if not isinstance(name, str) or any(0xD800 <= ord(letter) <= 0xDFFF for letter in name)
    ]
    if wrong_ones:
        with pytest.raises(MessageError, match=rf"joint_names\[{wrong_ones[0]}\]"):
            TYPES.checked(message)
    else:
        assert TYPES.checked(message) is message


@pytest.mark.parametrize("thing", [None, 5, "order", Pose()])
def test_value_that_is_no_message_is_refused(thing: Any) -> None:
    with pytest.raises(MessageError, match="is not a message"):
        TYPES.checked(thing)
    stranger: Any = type("Stranger", (), {"__msgtype__": "my_msgs/msg/Mine"})()
    with pytest.raises(UnknownNameError, match="my_msgs"):
        TYPES.checked(stranger)


@pytest.mark.parametrize("named", [None, 3, "std_msgs/msg/String", "", np.array(["a"]), ["x"]])
def test_message_with_other_msgtype_is_refused(named: Any) -> None:
    wrong_type = {"__msgtype__": named}
    with pytest.raises(MessageError, match=r"^std_msgs/Header is of type std_msgs/Header, but its __msgtype__ is"):
        TYPES.checked(replace(header("base", 3), **wrong_type))
    with pytest.raises(MessageError, match=r"^std_msgs/Header.stamp is of type builtin_interfaces/Time, but its"):
        TYPES.checked(replace(header("base", 3), stamp=replace(Time(1, 2), **wrong_type)))
