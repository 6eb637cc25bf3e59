"""Messages and services of controller_manager_msgs, made of `definitions/controller_manager_msgs`.

Generated: change the definitions, and run `python -m tools.message_classes`.
"""

from dataclasses import field
from typing import ClassVar

from cellwright.middleware.messages.message_class import MessageClass, message_class


@message_class("controller_manager_msgs/msg/HardwareInterfaceResources")
class HardwareInterfaceResources(MessageClass):
    """Resources that a controller has claimed of one hardware interface."""

    hardware_interface: str = ""  # type of the interface
    resources: list[str] = field(default_factory=list)  # names of the joints


@message_class("controller_manager_msgs/msg/ControllerState")
class ControllerState(MessageClass):
    """State of a loaded controller."""

    name: str = ""
    state: str = ""  # "running" or "stopped"
    type: str = ""
    claimed_resources: list[HardwareInterfaceResources] = field(default_factory=list)


@message_class("controller_manager_msgs/srv/ListControllerTypes_Request")
class ListControllerTypesRequest(MessageClass):
    """Returns the known types of controllers."""

    structure_needs_at_least_one_member: int = 0


@message_class("controller_manager_msgs/srv/ListControllerTypes_Response")
class ListControllerTypesResponse(MessageClass):
    """Response of controller_manager_msgs/ListControllerTypes."""

    types: list[str] = field(default_factory=list)
    base_classes: list[str] = field(default_factory=list)  # base class of each type


@message_class("controller_manager_msgs/srv/ListControllers_Request")
class ListControllersRequest(MessageClass):
    """Returns the loaded controllers."""

    structure_needs_at_least_one_member: int = 0


@message_class("controller_manager_msgs/srv/ListControllers_Response")
class ListControllersResponse(MessageClass):
    """Response of controller_manager_msgs/ListControllers."""

    controller: list[ControllerState] = field(default_factory=list)


@message_class("controller_manager_msgs/srv/LoadController_Request")
class LoadControllerRequest(MessageClass):
    """Loads a controller."""

    name: str = ""


@message_class("controller_manager_msgs/srv/LoadController_Response")
class LoadControllerResponse(MessageClass):
    """Response of controller_manager_msgs/LoadController."""

    ok: bool = False  # whether it was loaded


@message_class("controller_manager_msgs/srv/ReloadControllerLibraries_Request")
class ReloadControllerLibrariesRequest(MessageClass):
    """Loads the libraries of controllers again."""

    force_kill: bool = False  # stop and unload the controllers first


@message_class("controller_manager_msgs/srv/ReloadControllerLibraries_Response")
class ReloadControllerLibrariesResponse(MessageClass):
    """Response of controller_manager_msgs/ReloadControllerLibraries."""

    ok: bool = False  # whether they were loaded


@message_class("controller_manager_msgs/srv/SwitchController_Request")
class SwitchControllerRequest(MessageClass):
    """Starts and stops controllers, as in the releases of 2017."""

    start_controllers: list[str] = field(default_factory=list)
    stop_controllers: list[str] = field(default_factory=list)
    strictness: int = 0  # BEST_EFFORT or STRICT
    BEST_EFFORT: ClassVar[int] = 1
    STRICT: ClassVar[int] = 2


@message_class("controller_manager_msgs/srv/SwitchController_Response")
class SwitchControllerResponse(MessageClass):
    """Response of controller_manager_msgs/SwitchController."""

    ok: bool = False  # whether the controllers were switched


@message_class("controller_manager_msgs/srv/UnloadController_Request")
class UnloadControllerRequest(MessageClass):
    """Unloads a controller."""

    name: str = ""


@message_class("controller_manager_msgs/srv/UnloadController_Response")
class UnloadControllerResponse(MessageClass):
    """Response of controller_manager_msgs/UnloadController."""

    ok: bool = False  # whether it was unloaded
