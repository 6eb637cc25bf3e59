import dataclasses
import typing

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys.base import normalize_fieldname

from cellwright.middleware.messages import (
    TYPES,
    control_msgs,
    full_name,
    osrf_gear,
    short_name,
    standard,
    std_srvs,
    type_of,
)
from cellwright.util.errors import UnknownNameError, UsageError

BASES = {"uint64": int, "string": str, "bool": bool, "float32": float, "float64": float, "int32": int, "uint8": int}


def annotation_of(desc: typing.Any) -> object:
    """Return the expected annotation of a field with this description."""
    kind, content = desc
    if kind == Nodetype.BASE:
        return BASES[content[0]]
    if kind == Nodetype.NAME:
        return TYPES.ros2.types[content]
    member = content[0]
    for name in ("float64", "uint64"):
        if member == (Nodetype.BASE, (name, 0)):
            return np.ndarray[tuple[int, ...], np.dtype[np.dtype(name).type]]  # type: ignore[misc]
    return list[annotation_of(member)]  # type: ignore[misc]


def test_definitions_and_own_classes_match() -> None:
    assert {name for name, _ in TYPES.parsed()} == TYPES.own.keys()


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(TYPES.own))
def test_class_fields_match_definition(name: str) -> None:
    message_class: typing.Any = TYPES.own[name]
    constants, fields = dict(TYPES.parsed())[name]
    hints = typing.get_type_hints(message_class)
    assert [field.name for field in dataclasses.fields(message_class)] == [normalize_fieldname(f) for f, _ in fields]
    for field, desc in fields:
        assert hints[normalize_fieldname(field)] == annotation_of(desc), field
    for constant, _, value in constants:
        assert getattr(message_class, constant) == value
    empty = message_class()
    assert TYPES.checked(empty) is empty


def test_class_name_matches_type_name() -> None:
    for name, message_class in TYPES.own.items():
        assert message_class.__name__ == name.rpartition("/")[2].replace("_", "")


def test_default_fields_are_not_shared() -> None:
    one, other = osrf_gear.Kit(), osrf_gear.Kit()
    one.objects.append(osrf_gear.KitObject("gear_part"))
    assert other.objects == []
    assert one.objects[0].pose.orientation.w == 1.0


@pytest.mark.parametrize("name", ["osrf_gear/Order", "osrf_gear/msg/Order"])
def test_message_type_accepts_short_and_full_name(name: str) -> None:
    assert TYPES.message(name) is osrf_gear.Order


def test_message_type_returns_standard_class() -> None:
    assert TYPES.message("std_msgs/Float32") is standard.Float32
    assert TYPES.message("sensor_msgs/msg/JointState") is standard.JointState
    assert TYPES.message("std_srvs/srv/Trigger_Request") is std_srvs.TriggerRequest


@pytest.mark.parametrize("name", ["osrf_gear/AGVControl", "osrf_gear/srv/AGVControl"])
def test_service_type_accepts_short_and_full_name(name: str) -> None:
    service = TYPES.service(name)
    assert service.name == "osrf_gear/AGVControl"
    assert service.request is osrf_gear.AGVControlRequest
    assert service.response is osrf_gear.AGVControlResponse


def test_service_type_exists_for_every_service_file() -> None:
    services = [name for name in TYPES.sources if "/srv/" in name]
    assert len(services) == 17
    for name in services:
        assert TYPES.service(name).name == short_name(name)


def test_unknown_type_lists_types_of_package() -> None:
    with pytest.raises(UnknownNameError, match="unknown message 'osrf_gear/Shipment'") as error:
        TYPES.message("osrf_gear/Shipment")
    assert "osrf_gear/Order" in error.value.valid
    assert not any("AGVControl" in name or "std_msgs" in name for name in error.value.valid)
    with pytest.raises(UnknownNameError, match="unknown message package 'osrf_gaer'; did you mean osrf_gear"):
        TYPES.message("osrf_gaer/Order")
    with pytest.raises(UnknownNameError, match="unknown service type 'osrf_gear/DroneControl'") as error:
        TYPES.service("osrf_gear/DroneControl")
    assert "osrf_gear/AGVControl" in error.value.valid
    with pytest.raises(UnknownNameError):
        TYPES.service("osrf_gear/Order")
    with pytest.raises(UnknownNameError):
        TYPES.message("osrf_gear/AGVControl")


@pytest.mark.parametrize("name", ["Order", "", "/", "a//b", "a/b/c", "a/b/c/d", "osrf_gear/", "/Order"])
def test_malformed_type_name_is_refused(name: str) -> None:
    with pytest.raises(UsageError, match="not a type name"):
        TYPES.message(name)


def test_full_and_short_names_of_types() -> None:
    assert full_name("osrf_gear/AGVControl", "srv") == "osrf_gear/srv/AGVControl"
    assert short_name("osrf_gear/msg/Order") == "osrf_gear/Order"
    assert type_of(osrf_gear.Order()) == type_of(osrf_gear.Order) == "osrf_gear/Order"
    assert type_of(control_msgs.QueryTrajectoryStateRequest()) == "control_msgs/QueryTrajectoryState_Request"
