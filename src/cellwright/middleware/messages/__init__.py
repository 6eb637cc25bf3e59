"""Message and service types, from their definitions.

Standard ROS types come from the library (`standard`). Types that it lacks are defined here (`osrf_gear`,
`control_msgs`, `controller_manager_msgs`, `std_srvs`, and `cellwright_msgs` for what Cellwright adds). On the bus a
message is a dataclass in its ROS 2 form, and must not change once it is published. The ROS 1 form exists as bytes only.
"""

from cellwright.middleware.messages.serialization import ENCODINGS, from_cdr, from_ros1, to_cdr, to_ros1
from cellwright.middleware.messages.types import (
    Message,
    ServiceType,
    definition,
    full_name,
    md5,
    message_type,
    service_type,
    short_name,
    type_of,
)
from cellwright.middleware.messages.validation import checked, describe_value

__all__ = [
    "ENCODINGS",
    "Message",
    "ServiceType",
    "checked",
    "definition",
    "describe_value",
    "from_cdr",
    "from_ros1",
    "full_name",
    "md5",
    "message_type",
    "service_type",
    "short_name",
    "to_cdr",
    "to_ros1",
    "type_of",
]
