"""Messages and services of osrf_gear, made of `definitions/osrf_gear`.

Generated: change the definitions, and run `python -m tools.message_classes`.
"""

from dataclasses import field

from cellwright.middleware.messages import conversions, standard
from cellwright.middleware.messages.message_class import MessageClass, message_class


@message_class("osrf_gear/msg/ConveyorBeltState")
class ConveyorBeltState(MessageClass):
    """State of the conveyor belt: its speed."""

    power: float = 0.0  # percentage of full speed (0.2 m/s), 0 to 100


@message_class("osrf_gear/msg/DetectedObject")
class DetectedObject(MessageClass):
    """A part on a tray."""

    type: str = ""  # "gear_part"
    is_faulty: bool = False  # a faulty part never counts for a kit
    pose: standard.Pose = field(default_factory=conversions.origin)  # in the frame of the tray


@message_class("osrf_gear/msg/KitObject")
class KitObject(MessageClass):
    """One part of a kit."""

    type: str = ""  # "gear_part"
    pose: standard.Pose = field(default_factory=conversions.origin)  # target pose, in the frame of the tray


@message_class("osrf_gear/msg/Kit")
class Kit(MessageClass):
    """A kit: parts for one tray, with their poses."""

    kit_type: str = ""  # its name, "order_0_kit_0"
    objects: list[KitObject] = field(default_factory=list)


@message_class("osrf_gear/msg/KitTray")
class KitTray(MessageClass):
    """A tray, and the kit that is built on it."""

    tray: str = ""  # identifier of the tray
    kit: Kit = field(default_factory=Kit)


@message_class("osrf_gear/msg/Model")
class Model(MessageClass):
    """A model in view of a logical camera."""

    type: str = ""  # "gear_part"
    pose: standard.Pose = field(default_factory=conversions.origin)  # in the frame of the camera


@message_class("osrf_gear/msg/LogicalCameraImage")
class LogicalCameraImage(MessageClass):
    """Image of a logical camera: types and poses instead of pixels."""

    models: list[Model] = field(default_factory=list)  # all known models that intersect the camera's frustum
    pose: standard.Pose = field(default_factory=conversions.origin)  # of the camera, in the world frame


@message_class("osrf_gear/msg/Order")
class Order(MessageClass):
    """An order: the kits that a customer requests."""

    order_id: str = ""  # "order_0"
    kits: list[Kit] = field(default_factory=list)


@message_class("osrf_gear/msg/PopulationState")
class PopulationState(MessageClass):
    """State of the conveyor belt's supply: whether parts are put onto the belt."""

    enabled: bool = False


@message_class("osrf_gear/msg/Proximity")
class Proximity(MessageClass):
    """Reading of a break beam."""

    # time of the measurement, and frame of the sensor
    header: standard.Header = field(default_factory=conversions.header)
    object_detected: bool = False  # whether an object interrupts the beam
    min_range: float = 0.0  # minimum detection distance [m]
    max_range: float = 0.0  # maximum detection distance [m]


@message_class("osrf_gear/msg/StorageUnit")
class StorageUnit(MessageClass):
    """A place with material."""

    unit_id: str = ""  # "bin7", "belt", "agv1_load_point"


@message_class("osrf_gear/msg/TrayContents")
class TrayContents(MessageClass):
    """All parts on a tray."""

    tray: str = ""  # identifier of the tray
    objects: list[DetectedObject] = field(default_factory=list)  # poses in the frame of the tray


@message_class("osrf_gear/msg/VacuumGripperState")
class VacuumGripperState(MessageClass):
    """State of the vacuum gripper: suction, and whether it holds a part."""

    enabled: bool = False  # whether the suction is on
    attached: bool = False  # whether a part is attached


@message_class("osrf_gear/srv/AGVControl_Request")
class AGVControlRequest(MessageClass):
    """Sends an AGV off with its tray, which submits the tray as a kit."""

    kit_type: str = ""  # the kit that the tray counts as, "order_0_kit_0"


@message_class("osrf_gear/srv/AGVControl_Response")
class AGVControlResponse(MessageClass):
    """Response of osrf_gear/AGVControl."""

    success: bool = False  # whether the AGV was ready to go


@message_class("osrf_gear/srv/ConveyorBeltControl_Request")
class ConveyorBeltControlRequest(MessageClass):
    """Sets the power of the conveyor belt."""

    state: ConveyorBeltState = field(default_factory=ConveyorBeltState)  # power from 0 to 100; any other has no effect


@message_class("osrf_gear/srv/ConveyorBeltControl_Response")
class ConveyorBeltControlResponse(MessageClass):
    """Response of osrf_gear/ConveyorBeltControl."""

    success: bool = False


@message_class("osrf_gear/srv/GetMaterialLocations_Request")
class GetMaterialLocationsRequest(MessageClass):
    """Returns the storage units with parts of a type, or trays."""

    material_type: str = ""  # "gear_part", or "tray"


@message_class("osrf_gear/srv/GetMaterialLocations_Response")
class GetMaterialLocationsResponse(MessageClass):
    """Response of osrf_gear/GetMaterialLocations."""

    storage_units: list[StorageUnit] = field(default_factory=list)  # empty for a type that does not exist


@message_class("osrf_gear/srv/PopulationControl_Request")
class PopulationControlRequest(MessageClass):
    """Controls the flow of parts onto the conveyor belt."""

    action: str = ""  # "pause", "resume" or "restart"


@message_class("osrf_gear/srv/PopulationControl_Response")
class PopulationControlResponse(MessageClass):
    """Response of osrf_gear/PopulationControl."""

    success: bool = False


@message_class("osrf_gear/srv/SubmitTray_Request")
class SubmitTrayRequest(MessageClass):
    """Scores a tray as a kit where it stands."""

    tray_id: str = ""  # identifier of the tray
    kit_type: str = ""  # the kit that it counts as


@message_class("osrf_gear/srv/SubmitTray_Response")
class SubmitTrayResponse(MessageClass):
    """Response of osrf_gear/SubmitTray."""

    success: bool = False  # whether there is such a tray
    inspection_result: float = 0.0  # score of the kit


@message_class("osrf_gear/srv/VacuumGripperControl_Request")
class VacuumGripperControlRequest(MessageClass):
    """Switches the suction of the vacuum gripper."""

    enable: bool = False  # true: on; false: off, which releases the part


@message_class("osrf_gear/srv/VacuumGripperControl_Response")
class VacuumGripperControlResponse(MessageClass):
    """Response of osrf_gear/VacuumGripperControl."""

    success: bool = False
