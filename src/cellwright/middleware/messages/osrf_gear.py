"""Classes of the messages and services of the 2017 competition (`definitions/osrf_gear`).

Quaternions in messages are (x, y, z, w); `build.py` turns them. Every field has a value to begin with.
"""

from dataclasses import dataclass, field
from typing import ClassVar

from cellwright.middleware.messages.conversions import header, origin
from cellwright.middleware.messages.standard import Header, Pose


@dataclass(slots=True)
class ConveyorBeltState:
    """How fast the conveyor belt runs: `power` in percent of full speed."""

    power: float = 0.0
    __msgtype__: ClassVar[str] = "osrf_gear/msg/ConveyorBeltState"


@dataclass(slots=True)
class DetectedObject:
    """A part on a tray, its pose in the tray frame."""

    type: str = ""
    is_faulty: bool = False
    pose: Pose = field(default_factory=origin)
    __msgtype__: ClassVar[str] = "osrf_gear/msg/DetectedObject"


@dataclass(slots=True)
class KitObject:
    """One part of a kit; the pose where it belongs is in the tray frame."""

    type: str = ""
    pose: Pose = field(default_factory=origin)
    __msgtype__: ClassVar[str] = "osrf_gear/msg/KitObject"


@dataclass(slots=True)
class Kit:
    """A kit by its name (`order_0_kit_0`), and its parts."""

    kit_type: str = ""
    objects: list[KitObject] = field(default_factory=list)
    __msgtype__: ClassVar[str] = "osrf_gear/msg/Kit"


@dataclass(slots=True)
class KitTray:
    """A tray and the kit that is built on it."""

    tray: str = ""
    kit: Kit = field(default_factory=Kit)
    __msgtype__: ClassVar[str] = "osrf_gear/msg/KitTray"


@dataclass(slots=True)
class Model:
    """A thing in view of a logical camera, its pose in the camera frame."""

    type: str = ""
    pose: Pose = field(default_factory=origin)
    __msgtype__: ClassVar[str] = "osrf_gear/msg/Model"


@dataclass(slots=True)
class LogicalCameraImage:
    """What a logical camera makes out; `pose` is the camera's, in the world frame."""

    models: list[Model] = field(default_factory=list)
    pose: Pose = field(default_factory=origin)
    __msgtype__: ClassVar[str] = "osrf_gear/msg/LogicalCameraImage"


@dataclass(slots=True)
class Order:
    """An order by its identifier (`order_0`), and its kits."""

    order_id: str = ""
    kits: list[Kit] = field(default_factory=list)
    __msgtype__: ClassVar[str] = "osrf_gear/msg/Order"


@dataclass(slots=True)
class PopulationState:
    """Whether parts are being put onto the conveyor belt."""

    enabled: bool = False
    __msgtype__: ClassVar[str] = "osrf_gear/msg/PopulationState"


@dataclass(slots=True)
class Proximity:
    """The reading of a break beam; ranges in m, single precision."""

    header: Header = field(default_factory=header)
    object_detected: bool = False
    min_range: float = 0.0
    max_range: float = 0.0
    __msgtype__: ClassVar[str] = "osrf_gear/msg/Proximity"


@dataclass(slots=True)
class StorageUnit:
    """A place where material is found: `bin7`, `belt`, `agv1_load_point`."""

    unit_id: str = ""
    __msgtype__: ClassVar[str] = "osrf_gear/msg/StorageUnit"


@dataclass(slots=True)
class TrayContents:
    """All that lies on a tray, poses in the tray frame."""

    tray: str = ""
    objects: list[DetectedObject] = field(default_factory=list)
    __msgtype__: ClassVar[str] = "osrf_gear/msg/TrayContents"


@dataclass(slots=True)
class VacuumGripperState:
    """Whether the suction is on, and whether something hangs on the cup."""

    enabled: bool = False
    attached: bool = False
    __msgtype__: ClassVar[str] = "osrf_gear/msg/VacuumGripperState"


@dataclass(slots=True)
class AGVControlRequest:
    """Send an AGV off with its tray as a kit."""

    kit_type: str = ""
    __msgtype__: ClassVar[str] = "osrf_gear/srv/AGVControl_Request"


@dataclass(slots=True)
class AGVControlResponse:
    """Whether the AGV was ready to go."""

    success: bool = False
    __msgtype__: ClassVar[str] = "osrf_gear/srv/AGVControl_Response"


@dataclass(slots=True)
class ConveyorBeltControlRequest:
    """Set the power of the conveyor belt."""

    state: ConveyorBeltState = field(default_factory=ConveyorBeltState)
    __msgtype__: ClassVar[str] = "osrf_gear/srv/ConveyorBeltControl_Request"


@dataclass(slots=True)
class ConveyorBeltControlResponse:
    """Whether the caller may set the belt's power."""

    success: bool = False
    __msgtype__: ClassVar[str] = "osrf_gear/srv/ConveyorBeltControl_Response"


@dataclass(slots=True)
class GetMaterialLocationsRequest:
    """Ask where parts of a type are found."""

    material_type: str = ""
    __msgtype__: ClassVar[str] = "osrf_gear/srv/GetMaterialLocations_Request"


@dataclass(slots=True)
class GetMaterialLocationsResponse:
    """The places; empty for a type that is nowhere."""

    storage_units: list[StorageUnit] = field(default_factory=list)
    __msgtype__: ClassVar[str] = "osrf_gear/srv/GetMaterialLocations_Response"


@dataclass(slots=True)
class PopulationControlRequest:
    """Steer the flow of parts onto the belt: `pause`, `resume` or `restart`."""

    action: str = ""
    __msgtype__: ClassVar[str] = "osrf_gear/srv/PopulationControl_Request"


@dataclass(slots=True)
class PopulationControlResponse:
    """Whether the action was one of the three."""

    success: bool = False
    __msgtype__: ClassVar[str] = "osrf_gear/srv/PopulationControl_Response"


@dataclass(slots=True)
class SubmitTrayRequest:
    """Have a tray scored as a kit where it stands."""

    tray_id: str = ""
    kit_type: str = ""
    __msgtype__: ClassVar[str] = "osrf_gear/srv/SubmitTray_Request"


@dataclass(slots=True)
class SubmitTrayResponse:
    """Whether there is such a tray, and the kit's score in single precision."""

    success: bool = False
    inspection_result: float = 0.0
    __msgtype__: ClassVar[str] = "osrf_gear/srv/SubmitTray_Response"


@dataclass(slots=True)
class VacuumGripperControlRequest:
    """Switch the suction on (`enable`) or off."""

    enable: bool = False
    __msgtype__: ClassVar[str] = "osrf_gear/srv/VacuumGripperControl_Request"


@dataclass(slots=True)
class VacuumGripperControlResponse:
    """Always success."""

    success: bool = False
    __msgtype__: ClassVar[str] = "osrf_gear/srv/VacuumGripperControl_Response"
