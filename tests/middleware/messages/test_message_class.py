"""Names of types: short and full forms, and wrong ones."""

import pytest

from cellwright.middleware.messages.message_class import SERVICE, full_name, short_name, type_of
from cellwright.middleware.messages.osrf_gear import AGVControlRequest, Order
from cellwright.util.errors import UsageError


@pytest.mark.parametrize("name", ["osrf_gear/Order", "osrf_gear/msg/Order"])
def test_names_of_message_are_completed_and_shortened(name: str) -> None:
    assert full_name(name) == Order.__msgtype__
    assert short_name(name) == type_of(Order) == type_of(Order()) == "osrf_gear/Order"


def test_half_of_service_is_named_as_message_or_service() -> None:
    assert full_name("osrf_gear/srv/AGVControl_Request") == AGVControlRequest.__msgtype__
    assert full_name("osrf_gear/AGVControl", SERVICE) == "osrf_gear/srv/AGVControl"
    assert type_of(AGVControlRequest) == "osrf_gear/AGVControl_Request"


@pytest.mark.parametrize("name", ["", "Order", "osrf_gear/", "/Order", "osrf_gear/action/Order", "a/msg/b/c"])
def test_name_of_other_form_is_refused(name: str) -> None:
    with pytest.raises(UsageError, match="is not a type name; write it like 'osrf_gear/Order'"):
        full_name(name)
