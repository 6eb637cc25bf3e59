"""Messages and services of std_srvs, made of `definitions/std_srvs`.

Generated: change the definitions, and run `python -m tools.message_classes`.
"""

from cellwright.middleware.messages.message_class import MessageClass, message_class


@message_class("std_srvs/srv/Empty_Request")
class EmptyRequest(MessageClass):
    """Triggers an action, without a result."""

    structure_needs_at_least_one_member: int = 0


@message_class("std_srvs/srv/Empty_Response")
class EmptyResponse(MessageClass):
    """Response of std_srvs/Empty."""

    structure_needs_at_least_one_member: int = 0


@message_class("std_srvs/srv/SetBool_Request")
class SetBoolRequest(MessageClass):
    """Switches on or off."""

    data: bool = False  # true: on


@message_class("std_srvs/srv/SetBool_Response")
class SetBoolResponse(MessageClass):
    """Response of std_srvs/SetBool."""

    success: bool = False  # whether it succeeded
    message: str = ""  # the result in words


@message_class("std_srvs/srv/Trigger_Request")
class TriggerRequest(MessageClass):
    """Triggers an action."""

    structure_needs_at_least_one_member: int = 0


@message_class("std_srvs/srv/Trigger_Response")
class TriggerResponse(MessageClass):
    """Response of std_srvs/Trigger."""

    success: bool = False  # whether it succeeded
    message: str = ""  # the result in words
