"""Classes of the standard services (`definitions/std_srvs`)."""

from dataclasses import dataclass
from typing import ClassVar


@dataclass(slots=True)
class TriggerRequest:
    """Nothing: the call says it all. A message in ROS 2 cannot be empty, hence the one field."""

    structure_needs_at_least_one_member: int = 0
    __msgtype__: ClassVar[str] = "std_srvs/srv/Trigger_Request"


@dataclass(slots=True)
class TriggerResponse:
    """Whether it took, and how it went, for people."""

    success: bool = False
    message: str = ""
    __msgtype__: ClassVar[str] = "std_srvs/srv/Trigger_Response"


@dataclass(slots=True)
class EmptyRequest:
    """Nothing: the call says it all."""

    structure_needs_at_least_one_member: int = 0
    __msgtype__: ClassVar[str] = "std_srvs/srv/Empty_Request"


@dataclass(slots=True)
class EmptyResponse:
    """Nothing: that it came says it all."""

    structure_needs_at_least_one_member: int = 0
    __msgtype__: ClassVar[str] = "std_srvs/srv/Empty_Response"


@dataclass(slots=True)
class SetBoolRequest:
    """Switch on (`data`) or off."""

    data: bool = False
    __msgtype__: ClassVar[str] = "std_srvs/srv/SetBool_Request"


@dataclass(slots=True)
class SetBoolResponse:
    """Whether it took, and how it went, for people."""

    success: bool = False
    message: str = ""
    __msgtype__: ClassVar[str] = "std_srvs/srv/SetBool_Response"
