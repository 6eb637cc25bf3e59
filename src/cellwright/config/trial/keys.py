"""The entries of a trial's file, section by section: what the readers look for, and what the reference says of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import get_args

from cellwright.config.layout import BIN_PART_HEIGHT, BIN_WIDTH
from cellwright.config.parsing.reader import REQUIRED, Key, Keys
from cellwright.config.trial.trial import (
    ArmSettings,
    Camera,
    CameraType,
    CellSettings,
    JointGains,
    JointTolerance,
    Options,
    PictureNoise,
    SensorType,
    ServoProfile,
    Trial,
    WhenLate,
)
from cellwright.util.pose import Pose

_TRIAL, _CELL, _ARM, _TOLERANCE, _OPTIONS = Trial(""), CellSettings(), ArmSettings(), JointTolerance(), Options()
_GAINS = JointGains(p=0.0, d=0.0)
_CAMERA, _NOISE = Camera("", "", Pose()), PictureNoise()
_POSE = "`{xyz: [x, y, z], rpy: [roll, pitch, yaw]}`, m and rad; either may be left out and is zero then"

DEFAULT_ALIASES: Mapping[str, str] = {"belt_model_type1": "part1", "belt_model_type2": "part2"}
"""Other names of part types, unless a file has its own."""

DEFAULT_KITS = 1
"""How many equal kits an order asks for."""

SECTIONS = Keys(
    Key("arm", "`{type: ur10}`", "there is an arm; every other entry is ignored", "no arm"),
    Key("sensors", "`{name: {type, pose}}`", "sensors, see below"),
    Key("options", "`{option: …}`", "what of the rest comes into the cell, see below", "see below"),
    Key("time_limit", "seconds", "after so long the trial is over; negative: never", _TRIAL.time_limit),
    Key("orders", "`{name: {…}}`", "what is asked for, see below"),
    Key("models_over_bins", "`{bin: {models: {part type: grid}, xyz}}`", "grids of parts, see below"),
    Key("belt_parts", "`{part type: {seconds: {pose}}}`", "what the belt brings, see below"),
    Key(
        "faulty_parts",
        "list of names",
        "parts that earn nothing, without what stands before their last &#124;: `gear_part_3`, `gear_part_clone_0`",
    ),
    Key("drops", "`{drop_regions: {name: {…}}}`", "regions in which the gripper loses parts, see below"),
    Key("models_to_spawn", "`{frame: {models: {any name: {type, pose}}}}`", "single parts in the frames of links"),
)
"""The sections of the 2017 format."""

SENSOR = Keys(
    Key("type", ", ".join(f"`{each}`" for each in get_args(SensorType)), "what it is", REQUIRED),
    Key("pose", _POSE, "where it is fixed, in the world frame", REQUIRED),
)

PART = Keys(Key("type", "a part type", "what it is", REQUIRED), Key("pose", _POSE, "where it is, or belongs", REQUIRED))

_SWITCH = "true or false"
SWITCHES = Keys(
    Key("insert_agvs", _SWITCH, "AGVs, trays and quality control sensors are there", _OPTIONS.insert_agvs),
    Key(
        "insert_models_over_bins",
        _SWITCH,
        "the parts of `models_over_bins` are there",
        _OPTIONS.insert_models_over_bins,
    ),
    Key("spawn_extra_models", _SWITCH, "the parts of `models_to_spawn` are there", _OPTIONS.spawn_extra_models),
    Key(
        "fill_demo_tray", _SWITCH, "at the start the first order's parts drop on AGV 1's tray", _OPTIONS.fill_demo_tray
    ),
    *(
        Key(name, _SWITCH, "read, without effect on the simulation", getattr(_OPTIONS, name))
        for name in ("gazebo_state_logging", "disable_shadows", "unthrottled_physics_update")
    ),
)
CYCLES = "belt_population_cycles"
ALIASES = "model_type_aliases"
OPTIONS = Keys(
    *SWITCHES,
    Key(
        CYCLES,
        "whole number",
        "how often the list of belt parts is gone through; 0 for an empty belt",
        _OPTIONS.belt_population_cycles,
    ),
    Key(
        ALIASES,
        "`{name: part type}`",
        "other names for part types; yours replace these",
        f"`{{{', '.join(f'{name}: {part}' for name, part in DEFAULT_ALIASES.items())}}}`",
    ),
)

ORDER = Keys(
    Key(
        "announcement_condition",
        "`time`, `wanted_parts` or `unwanted_parts`",
        "when it is announced: after a time, or when so many parts lie on a tray that it wants, or does not want; with "
        "any other word never",
        REQUIRED,
    ),
    Key(
        "announcement_condition_value",
        "seconds, or a number of parts",
        "of that condition; a number of parts below 1 is no condition",
        REQUIRED,
    ),
    Key("parts", "`{any name: {type, pose}}`", "of a kit, with poses in the tray's frame", REQUIRED),
    Key("kit_count", "whole number", "how many equal kits", DEFAULT_KITS),
)

BIN = Keys(
    Key("models", "`{part type: grid}`", "the parts", REQUIRED),
    Key(
        "xyz",
        "three lengths, m",
        "where coordinates count from, in the world frame; needed for places other than `bin1` to `bin8`",
        f"the bin's corner: its centre −{BIN_WIDTH / 2:g} m in x and y, at a height of {BIN_PART_HEIGHT:g} m",
    ),
)
GRID = Keys(
    Key("xyz_start", "three plain numbers, m", "the first part", REQUIRED),
    Key("xyz_end", "two or three plain numbers, m", "the last part; all stand at the first one's height", REQUIRED),
    Key("rpy", "three angles, rad", "how each is turned", REQUIRED),
    Key("num_models_x", "whole number", "parts along x", REQUIRED),
    Key("num_models_y", "whole number", "parts along y", REQUIRED),
)

DROP_REGION = Keys(
    Key("min", "`{xyz}`, m", "a corner of the region, in the world frame", REQUIRED),
    Key("max", "`{xyz}`, m", "the opposite corner; which is which does not matter", REQUIRED),
    Key("destination", _POSE, "where the part then is, in the world frame; `xyz` must be there", REQUIRED),
    Key("part_type_to_drop", "a part type", "what is lost there, once", REQUIRED),
)

OWN = Keys(
    Key("seed", "0 to 2⁶³−1", "root of all chance", _CELL.seed),
    Key(
        "timestep",
        "seconds, a decimal or a fraction, 1/100000 to 1/50",
        "length of a step",
        "/".join(map(str, _CELL.timestep)),
    ),
    Key("arm", "`{…}`", "how the arm is controlled, see below", "see below"),
    Key("parts", "`{part type: {…}}`", "part types of your own: [Models of your own](own-models.md)"),
    Key("furniture", "list", "furniture of your own: [Models of your own](own-models.md)"),
    Key("sensors", "`{name: {type, pose, …}}`", "cameras that take pictures, see below"),
    Key("devices", "`{name: {type, …}}`", "devices that other packages bring along: [Plugins](plugins.md)"),
)
"""The section `cellwright`."""

OWN_ARM = Keys(
    Key(
        "servo",
        " or ".join(f"`{each}`" for each in get_args(ServoProfile)),
        "the competition's gains and compliance, or such as track below 1 mrad",
        f"`{_ARM.servo}`",
    ),
    Key("gains", "`{joint: {p, d, i, i_clamp}}`", "gains of the servos of single joints", "the profile's"),
    Key("dry_friction", "`{joint: friction}`, N m or N, not negative", "dry friction of single joints", "none"),
    Key("constraints", "`{…, joint: {…}}`", "when a trajectory has failed", "see below"),
    Key(
        "stop_trajectory_duration",
        "seconds",
        "in which the arm comes to rest when it is told to hold",
        _ARM.stop_trajectory_duration,
    ),
    Key(
        "allow_partial_joints_goal",
        _SWITCH,
        "whether a command may name some of the joints only",
        _ARM.allow_partial_joints_goal,
    ),
    Key(
        "initial_joint_states",
        "`{joint: position}`, rad or m, expressions allowed",
        "where the arm begins",
        "the usual place of each joint",
    ),
)
"""What stands under `arm` in the section `cellwright`."""

GAINS = Keys(
    Key("p", "N m/rad or N/m, not negative", "force for each distance from the target", REQUIRED),
    Key("d", "N m s/rad or N s/m, not negative", "force for each difference in velocity", REQUIRED),
    Key("i", "N m/(rad s) or N/(m s), not negative", "force for the integral of the distance", _GAINS.i),
    Key("i_clamp", "N m or N, not negative", "most that the integral comes to", _GAINS.i_clamp),
)
CONSTRAINTS = Keys(
    Key("goal_time", "seconds", "after its end in which a goal may still be reached", _ARM.goal_time),
    Key(
        "stopped_velocity_tolerance",
        "rad/s or m/s",
        "so slow a joint counts as standing",
        _ARM.stopped_velocity_tolerance,
    ),
)
TOLERANCE = Keys(
    Key("trajectory", "rad or m; 0: not checked", "how far it may stray on its way", _TOLERANCE.trajectory),
    Key("goal", "rad or m; 0: not checked", "how far from its goal it may end", _TOLERANCE.goal),
)

CAMERA = Keys(
    Key(
        "type",
        ", ".join(f"`{each}`" for each in get_args(CameraType)),
        "whether it takes colour pictures, measures depth, or both",
        REQUIRED,
    ),
    Key("pose", _POSE, "where it is fixed; it looks along +x, and z is up", REQUIRED),
    Key(
        "frame", "`world`, or a link of the arm", "what it is fixed to, and the pose is given in", f"`{_CAMERA.frame}`"
    ),
    Key("width", "pixels", "width of its pictures", _CAMERA.width),
    Key("height", "pixels", "height of its pictures", _CAMERA.height),
    Key("fov", "rad", "how far it sees to the left and right together", f"{_CAMERA.fov:g}"),
    Key("rate", "Hz", "pictures a second of simulation time", _CAMERA.rate),
    Key("near", "m", "depths below this are not measured", _CAMERA.near),
    Key("far", "m", "depths above this are not measured", _CAMERA.far),
    Key("shadows", _SWITCH, "things throw shadows in its colour pictures, which take longer to draw", _CAMERA.shadows),
    Key("noise", "`{colour, depth, depth_growth}`", "noise of its pictures; 0 for none at all", "see below"),
    Key("latency", "seconds", "from the moment that a picture shows to its delivery", "the time between two pictures"),
    Key(
        "when_late",
        ", ".join(f"`{each}`" for each in get_args(WhenLate)),
        "what happens when a picture is due and not drawn yet: time waits for it; or it comes later, and others are "
        "left out for it; `auto` waits, but where time goes by the wall clock",
        f"`{_CAMERA.when_late}`",
    ),
)
"""A camera under `sensors` in the section `cellwright`."""

NOISE = Keys(
    Key("colour", "share of full brightness", "standard deviation of each colour of each pixel", _NOISE.colour),
    Key("depth", "m", "standard deviation of each depth", _NOISE.depth),
    Key("depth_growth", "1/m", "what comes to that with the square of the depth", _NOISE.depth_growth),
)
"""The noise of a camera."""
