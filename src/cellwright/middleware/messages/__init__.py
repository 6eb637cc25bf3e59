"""Message and service types, from their definitions.

Standard ROS types come from the library (`standard`). Types that it lacks are defined here (`osrf_gear`,
`control_msgs`, `controller_manager_msgs`, `std_srvs`, and `cellwright_msgs` for what Cellwright adds). On the bus a
message is a dataclass in its ROS 2 form, and must not change once it is published. The ROS 1 form exists as bytes only.
"""

from importlib.resources import files

from cellwright.middleware.messages import cellwright_msgs, control_msgs, controller_manager_msgs, osrf_gear, std_srvs
from cellwright.middleware.messages.message_class import Message, full_name, short_name, type_of
from cellwright.middleware.messages.types import ServiceType, TypeSet
from cellwright.middleware.messages.validation import describe_value

TYPES = TypeSet(
    files(__name__) / "definitions", (cellwright_msgs, control_msgs, controller_manager_msgs, osrf_gear, std_srvs)
)
"""Cellwright's own set: the standard types, those of 2017, and what Cellwright adds."""

__all__ = ["TYPES", "Message", "ServiceType", "TypeSet", "describe_value", "full_name", "short_name", "type_of"]
