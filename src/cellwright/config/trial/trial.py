"""Trial: the whole description of a cell, checked and resolved, with units.

`written` is a value as the file has it, for the loader's `resolved`. It takes no part in comparisons, and is None in a
trial without a file.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from cellwright.config.arm import ArmSettings
from cellwright.config.footprints import PART_TYPES
from cellwright.config.layout.arm_models import ArmModel, joints_of
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.layout import Carrier, Layout, Station
from cellwright.config.models.model import Furniture, UserModel
from cellwright.config.parsing.reader import Placement
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Limits
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.task import Task
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3


@dataclass(frozen=True, slots=True)
class Part:
    """Part that is in the cell from the start.

    `name` is the full model name (`bin7|piston_rod_part_3`). `pose` is in `frame`: "world", or the name of a link such
    as `agv1::kit_tray_1::kit_tray_1::tray`, as the file has it.
    """

    name: str
    type: str
    pose: Pose
    frame: str = "world"
    written: Placement | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class BeltPart:
    """Part that appears on a belt `time` [s] after the population starts; `pose` is in the belt's spawn frame.

    `belt` is the belt's name in the layout.
    """

    time: float
    type: str
    pose: Pose
    written: Placement | None = field(default=None, compare=False, repr=False)
    belt: str = "belt"


@dataclass(frozen=True, slots=True)
class KitObject:
    """Part of a kit with its target pose; `pose` is in the tray frame."""

    type: str
    pose: Pose
    written: Placement | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Kit:
    """Kit of an order; `kit_type` is its name, `order_0_kit_0`.

    `tray` names the AGV or the fixed tray that it has to be submitted from; None for any.
    """

    kit_type: str
    objects: tuple[KitObject, ...]
    tray: str | None = None


@dataclass(frozen=True, slots=True)
class Order:
    """Order with its announcement.

    At most one condition is set: `start_time` [s] after the start, or the number of parts on a tray that this order
    wants or does not want. Without one, the order is never announced. `written` is the condition's word and value.
    """

    order_id: str
    kits: tuple[Kit, ...]
    start_time: float | None = None
    wanted_parts: int | None = None
    unwanted_parts: int | None = None
    yaml_name: str = ""
    written: tuple[str, float] | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class DropRegion:
    """Box where the gripper loses a part of `type` once, which falls to `destination` (world frame).

    `lower` and `upper` are corners along the axes of `frame`, sorted per axis [m]. `written` are two corners and the
    destination.
    """

    name: str
    type: str
    lower: Vector3
    upper: Vector3
    destination: Pose
    written: tuple[Vector3, Vector3, Placement] | None = field(default=None, compare=False, repr=False)
    frame: Pose = field(default_factory=Pose)

    @property
    def centre(self) -> Vector3:
        """Middle of the box in the world [m]."""
        x, y, z = ((low + high) / 2 for low, high in zip(self.lower, self.upper, strict=True))
        return self.frame.transform((x, y, z))

    def covers(self, point: Vector3) -> bool:
        """Return whether a point of the world [m] is in the closed box."""
        at = self.frame.inverse().transform(point)
        return all(low <= value <= high for low, value, high in zip(self.lower, at, self.upper, strict=True))


@dataclass(frozen=True, slots=True)
class Options:
    """Supported `options` of the 2017 format, with their original defaults."""

    insert_agvs: bool = True
    insert_models_over_bins: bool = False
    fill_demo_tray: bool = False
    belt_population_cycles: int = 1
    spawn_extra_models: bool = False
    gazebo_state_logging: bool = False
    disable_shadows: bool = False
    unthrottled_physics_update: bool = False


@dataclass(frozen=True, slots=True)
class CellSettings:
    """Settings that Cellwright adds to a file, under its top-level key `cellwright`.

    `timestep` is in seconds: numerator and denominator here, a fraction "p/q" or a decimal in the file. Without
    `collision_culling` the engine's collision detection gets every body in every step.
    """

    seed: int = 0
    timestep: tuple[int, int] = (1, 500)
    collision_culling: bool = True
    arm: ArmSettings = field(default_factory=ArmSettings)


@dataclass(frozen=True, slots=True)
class PluginDevice:
    """Device of a plugin in the cell, with its settings as written."""

    name: str
    type: str
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Circumstances:
    """Properties that no file states and that differ between real cells; the defaults are the cell as written.

    Attributes:
        friction: coefficient of dry friction between parts and the surfaces that they touch.
        belt_delay: delay of the belt's first round of parts [s, at full power].
        gripper_phase: phase in each 0.1 s at which the gripper looks for parts [s]; None: as soon as it is switched on.
        seed: seed that they were drawn with; None if they were not drawn.
    """

    friction: float = 1.0
    belt_delay: float = 0.0
    gripper_phase: float | None = None
    seed: int | None = None


@dataclass(frozen=True, slots=True)
class Trial:
    """Whole trial: the cell, its parts, its orders and its faults.

    Attributes:
        name: the name of its first file.
        has_arm: True if the cell has an arm.
        sensors: sensors and cameras, in the order of the file.
        options: `options` of the 2017 format.
        time_limit: time until the trial is over [s], 0 or more; None for no limit.
        orders: orders in the order of their ids.
        bin_parts: parts in the bins.
        extra_parts: parts in the frames of links.
        belt_parts: parts of one round of the belt, by time.
        faulty_parts: names of faulty parts, without their origin.
        drop_regions: regions where the gripper loses a part.
        material_locations: places of each part type: bins, `belt`, load points.
        settings: seed, time step and control of the arm.
        initial_joint_states: initial positions of the arm's joints [rad; m]; the usual ones for joints not named.
        part_models: user-defined part types, by name.
        arm_models: models of the arms that have their own, by name.
        robot_models: configurations of the robots that are driven over their own topics, by name.
        robot_starts: initial positions of their joints [rad; m], by robot; the usual ones for joints not named.
        furniture: further static models in the cell.
        devices: devices of plugins.
        circumstances: properties that no file states, such as friction.
        overrides: values that replaced those of the files, as `KEY=VALUE`.
        task: task of a run, with its conditions of success; None without a section `task`.

    Raises:
        UsageError: the time limit is negative.

    Example:
        >>> from cellwright import load_trial
        >>> trial = load_trial("final01")
        >>> trial.name, trial.time_limit, len(trial.bin_parts)
        ('final01', 500.0, 28)
        >>> for part in trial.orders[0].kits[0].objects:
        ...     print(part.type, part.pose.position)
        piston_rod_part (0.1, -0.18, 0.0)
        gear_part (-0.12, -0.2, 0.0)
    """

    name: str
    has_arm: bool = False
    sensors: tuple[SensorConfig, ...] = ()
    options: Options = field(default_factory=Options)
    time_limit: float | None = 500.0
    orders: tuple[Order, ...] = ()
    bin_parts: tuple[Part, ...] = ()
    extra_parts: tuple[Part, ...] = ()
    belt_parts: tuple[BeltPart, ...] = ()
    faulty_parts: frozenset[str] = frozenset()
    drop_regions: tuple[DropRegion, ...] = ()
    material_locations: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    settings: CellSettings = field(default_factory=CellSettings)
    initial_joint_states: Mapping[str, float] = field(default_factory=dict)
    part_models: Mapping[str, UserModel] = field(default_factory=dict)
    arm_models: Mapping[str, ArmModel] = field(default_factory=dict)
    robot_models: Mapping[str, RobotConfig] = field(default_factory=dict)
    robot_starts: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    furniture: tuple[Furniture, ...] = ()
    devices: tuple[PluginDevice, ...] = ()
    circumstances: Circumstances = field(default_factory=Circumstances)
    overrides: tuple[str, ...] = field(default=(), compare=False)
    layout: Layout = field(default_factory=gear2017)
    task: Task | None = None

    def __post_init__(self) -> None:
        if self.time_limit is not None and self.time_limit < 0.0:
            raise UsageError(f"time_limit: must not be negative (got {self.time_limit:g}); use None for no limit")

    @property
    def arms(self) -> tuple[Arm, ...]:
        """Arms that are in the cell."""
        return self.layout.arms if self.has_arm else ()

    @property
    def joints(self) -> Mapping[str, Limits]:
        """Joints of all arms with their limits, base first; arms in a namespace put `ARM/` before the names."""
        found = ((each.start_prefix, joints_of(each, self.arm_models)) for each in self.arms)
        return {f"{prefix}{name}": limits for prefix, joints in found for name, limits in joints.items()}

    @property
    def carriers(self) -> tuple[Carrier, ...]:
        """Carriers that are in the cell."""
        return self.layout.carriers if self.options.insert_agvs else ()

    @property
    def stations(self) -> tuple[Station, ...]:
        """Places with a tray that are in the cell, in the order of their numbers: carriers, then fixed trays."""
        return (*self.carriers, *self.layout.trays)

    @property
    def reference_frames(self) -> Mapping[str, Pose]:
        """World poses of the frames for parts that are in the cell, by name."""
        absent = {each.tray_link for each in self.layout.carriers} - {each.tray_link for each in self.carriers}
        return {name: pose for name, pose in self.layout.reference_frames.items() if name not in absent}

    def belt_clones(self) -> tuple[tuple[str, str], ...]:
        """Names, without origin, and types of the belt's parts: `gear_part_clone_0`, type by type."""
        counts = Counter(part.type for part in self.belt_parts)
        cycles = self.options.belt_population_cycles
        return tuple((f"{kind}_clone_{k}", kind) for kind, count in counts.items() for k in range(cycles * count))

    def locations(self, material: str) -> tuple[str, ...]:
        """Return the storage units of a part type or of trays, or the tray that a kit has to be submitted from.

        There are none for what is unknown, nor for a kit that may come from any tray.
        """
        units = {each.name: each.location for each in self.stations}
        trays = [kit.tray for order in self.orders for kit in order.kits if kit.kit_type == material and kit.tray]
        return self.material_locations.get(material, tuple(units.get(name, name) for name in trays))

    def first_clones(self, belt: str) -> Mapping[str, int]:
        """Number of the first clone of each type on a belt: clones of the belts before it in the layout come first."""
        names = [each.name for each in self.layout.belts]
        before = names[: names.index(belt)]
        counts = Counter(part.type for part in self.belt_parts if part.belt in before)
        return {kind: self.options.belt_population_cycles * count for kind, count in counts.items()}

    def demo_clones(self) -> tuple[tuple[str, KitObject], ...]:
        """Names, without origin, of the parts that fill the demo tray, and their poses on it.

        They are the parts of the first order's first kit, without types that have no model.
        """
        if not (self.options.fill_demo_tray and self.stations and self.orders and self.orders[0].kits):
            return ()
        counts: Counter[str] = Counter()
        found = []
        for each in self.orders[0].kits[0].objects:
            if each.type in PART_TYPES or each.type in self.part_models:
                found.append((f"{each.type}_clone_{counts[each.type]}", each))
                counts[each.type] += 1
        return tuple(found)
