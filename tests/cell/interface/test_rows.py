"""The table, compared with independent figures."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.interface.rows import GEAR, rows
from cellwright.config.sensors import SensorConfig, SensorType
from cellwright.config.trial.trial import BeltPart, Options, Trial
from cellwright.middleware.bus import Bus, Direction
from cellwright.middleware.interface.table import Endpoint, EndpointKind, Timing
from cellwright.middleware.messages import TYPES
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

WHOLE = Trial(
    "whole",
    has_arm=True,
    sensors=(
        SensorConfig("break_beam_1", "break_beam", Pose()),
        SensorConfig("proximity_sensor_1", "proximity_sensor", Pose()),
        SensorConfig("laser_profiler_1", "laser_profiler", Pose()),
        SensorConfig("logical_camera_1", "logical_camera", Pose()),
        SensorConfig("logical_camera_2", "logical_camera", Pose()),
    ),
    belt_parts=(BeltPart(1.0, "gear_part", Pose()),),
)
BARE = Trial("bare", options=Options(insert_agvs=False))

# name: type, rate [Hz] or occasion, latched
OUT = {
    "/clock": ("rosgraph_msgs/Clock", "each step", False),
    "/tf": ("tf2_msgs/TFMessage", (50, 10), False),
    "/tf_static": ("tf2_msgs/TFMessage", "on event", True),
    "/ariac/competition_state": ("std_msgs/String", 10, False),
    "/ariac/current_score": ("std_msgs/Float32", 10, False),
    "/ariac/orders": ("osrf_gear/Order", "on event", True),
    "/ariac/joint_states": ("sensor_msgs/JointState", 50, False),
    "/ariac/arm/state": ("control_msgs/JointTrajectoryControllerState", 25, False),
    "/ariac/arm/follow_joint_trajectory/status": ("actionlib_msgs/GoalStatusArray", 5, True),
    "/ariac/arm/follow_joint_trajectory/feedback": ("control_msgs/FollowJointTrajectoryActionFeedback", 10, False),
    "/ariac/arm/follow_joint_trajectory/result": ("control_msgs/FollowJointTrajectoryActionResult", "on event", False),
    "/ariac/gripper/state": ("osrf_gear/VacuumGripperState", "each step", False),
    "/ariac/agv1/state": ("std_msgs/String", "each step", False),
    "/ariac/agv2/state": ("std_msgs/String", "each step", False),
    "/ariac/quality_control_sensor_1": ("osrf_gear/LogicalCameraImage", 10, True),
    "/ariac/quality_control_sensor_2": ("osrf_gear/LogicalCameraImage", 10, True),
    "/ariac/trays": ("osrf_gear/TrayContents", 1, False),
    "/ariac/population/state": ("osrf_gear/PopulationState", "each step", False),
    "/ariac/break_beam_1": ("osrf_gear/Proximity", 20, True),
    "/ariac/break_beam_1_change": ("osrf_gear/Proximity", "on event", True),
    "/ariac/proximity_sensor_1": ("sensor_msgs/Range", 20, False),
    "/ariac/laser_profiler_1": ("sensor_msgs/LaserScan", 100, False),
    "/ariac/logical_camera_1": ("osrf_gear/LogicalCameraImage", 10, True),
    "/ariac/logical_camera_2": ("osrf_gear/LogicalCameraImage", 10, True),
}
IN = {
    "/cellwright/intention": "std_msgs/String",
    "/cellwright/policy": "std_msgs/String",
    "/cellwright/operator/pose": "geometry_msgs/PoseStamped",
    "/cellwright/operator/velocity": "geometry_msgs/TwistStamped",
    "/cellwright/operator/joints": "sensor_msgs/JointState",
    "/cellwright/operator/command": "std_msgs/String",
    "/cellwright/operator/report": "std_msgs/String",
    "/ariac/arm/command": "trajectory_msgs/JointTrajectory",
    "/ariac/arm/follow_joint_trajectory/goal": "control_msgs/FollowJointTrajectoryActionGoal",
    "/ariac/arm/follow_joint_trajectory/cancel": "actionlib_msgs/GoalID",
}
SERVICES = {
    "/cellwright/part_types": "std_srvs/Trigger",
    "/cellwright/solids": "std_srvs/Trigger",
    "/ariac/start_competition": "std_srvs/Trigger",
    "/ariac/end_competition": "std_srvs/Trigger",
    "/ariac/material_locations": "osrf_gear/GetMaterialLocations",
    "/cellwright/layout": "std_srvs/Trigger",
    "/ariac/submit_tray": "osrf_gear/SubmitTray",
    "/ariac/arm/query_state": "control_msgs/QueryTrajectoryState",
    "/ariac/controller_manager/list_controllers": "controller_manager_msgs/ListControllers",
    "/ariac/controller_manager/list_controller_types": "controller_manager_msgs/ListControllerTypes",
    "/ariac/controller_manager/switch_controller": "controller_manager_msgs/SwitchController",
    "/ariac/controller_manager/load_controller": "controller_manager_msgs/LoadController",
    "/ariac/controller_manager/unload_controller": "controller_manager_msgs/UnloadController",
    "/ariac/controller_manager/reload_controller_libraries": "controller_manager_msgs/ReloadControllerLibraries",
    "/ariac/gripper/control": "osrf_gear/VacuumGripperControl",
    "/ariac/agv1": "osrf_gear/AGVControl",
    "/ariac/agv2": "osrf_gear/AGVControl",
    "/ariac/kit_tray_1/clear_tray": "std_srvs/Trigger",
    "/ariac/kit_tray_2/clear_tray": "std_srvs/Trigger",
    "/ariac/conveyor/control": "osrf_gear/ConveyorBeltControl",
    "/ariac/population/control": "osrf_gear/PopulationControl",
}


def named(trial: Trial, *, competition: bool = False) -> dict[str, Endpoint]:
    return {row.name: row for row in rows(trial, competition=competition)}


def test_published_topics_have_listed_types_rates_and_latches() -> None:
    out = [
        row
        for row in rows(WHOLE, competition=False)
        if (row.kind, row.direction) == (EndpointKind.TOPIC, Direction.OUT)
    ]
    found: dict[str, tuple[str, object, bool]] = {}
    for row in out:
        rate: object = row.rate.value if isinstance(row.rate, Timing) else row.rate
        if row.name == "/tf" and row.name in found:
            rate = (found["/tf"][1], rate)
        found[row.name] = (row.type, rate, row.latch)
    assert found == OUT


def test_accepted_topics_have_listed_types() -> None:
    heard = [
        row for row in rows(WHOLE, competition=False) if (row.kind, row.direction) == (EndpointKind.TOPIC, Direction.IN)
    ]
    assert {row.name: row.type for row in heard} == IN
    assert {(row.rate, row.latch, row.period, row.rate_text) for row in heard} == {(None, False, None, "")}


def test_services_and_actions_have_listed_types() -> None:
    found = rows(WHOLE, competition=False)
    assert {row.name: row.type for row in found if row.kind is EndpointKind.SERVICE} == SERVICES
    actions = [(row.name, row.type) for row in found if row.kind is EndpointKind.ACTION]
    assert actions == [("/ariac/arm/follow_joint_trajectory", "control_msgs/FollowJointTrajectory")]
    assert all(row.direction is Direction.IN for row in found if row.kind is not EndpointKind.TOPIC)


def test_competition_mode_refuses_silences_or_omits_rows() -> None:
    development, competition = named(WHOLE), named(WHOLE, competition=True)
    assert development.keys() - competition.keys() == {"/ariac/population/control"}
    special = {name: row.handler for name, row in competition.items() if row.handler != development[name].handler}
    assert special == {
        "/ariac/trays": "silence",
        "/ariac/conveyor/control": "refuse",
        "/ariac/submit_tray": "refuse",
        "/ariac/kit_tray_1/clear_tray": "refuse",
        "/ariac/kit_tray_2/clear_tray": "refuse",
    }


def test_bare_cell_has_rows_that_are_always_there() -> None:
    assert named(BARE).keys() == {
        "/clock",
        "/tf_static",
        "/ariac/competition_state",
        "/ariac/current_score",
        "/ariac/orders",
        "/ariac/start_competition",
        "/ariac/end_competition",
        "/ariac/material_locations",
        "/cellwright/layout",
        "/ariac/submit_tray",
        "/ariac/conveyor/control",
        "/cellwright/intention",
        "/cellwright/policy",
        "/cellwright/part_types",
        "/cellwright/solids",
    }


@pytest.mark.parametrize(
    ("trial", "expected"),
    [
        (
            Trial("", has_arm=True, options=Options(insert_agvs=False)),
            {"/ariac/joint_states", "/ariac/gripper/control"},
        ),
        (Trial(""), {"/ariac/agv2", "/ariac/trays", "/tf", "/ariac/kit_tray_1/clear_tray"}),
        (Trial("", belt_parts=WHOLE.belt_parts), {"/ariac/population/state", "/ariac/population/control"}),
        (Trial("", sensors=WHOLE.sensors[3:4], options=Options(insert_agvs=False)), {"/tf", "/ariac/logical_camera_1"}),
    ],
)
def test_device_of_cell_adds_its_rows(trial: Trial, expected: set[str]) -> None:
    assert expected <= named(trial).keys()
    assert not expected & named(BARE).keys()


def test_clock_and_tf_have_publishers_of_original() -> None:
    """As in the original's node graph: `/tf` has two publishers, `/tf_static` and `/clock` one each."""
    publishers = [
        (row.name, row.node) for row in rows(WHOLE, competition=False) if row.name[:4] in ("/tf", "/tf_", "/clo")
    ]
    assert publishers == [
        ("/clock", "/gazebo"),
        ("/tf", "/robot_state_publisher"),
        ("/tf", "/gazebo"),
        ("/tf_static", "/robot_state_publisher"),
    ]


def test_rows_have_subject_and_rate() -> None:
    found = named(WHOLE)
    change = found["/ariac/break_beam_1_change"]
    assert (change.name, change.subject) == ("/ariac/break_beam_1_change", "break_beam_1")
    assert found["/ariac/agv2/state"].subject == "agv2"
    assert found["/ariac/orders"].subject is None
    assert found["/ariac/joint_states"].period == Fraction(1, 50)
    assert found["/ariac/joint_states"].rate_text == "50 Hz"
    assert found["/clock"].rate_text == "each step"
    assert found["/clock"].period is None


@pytest.mark.parametrize("row", GEAR, ids=lambda row: row.name)
def test_row_has_type_about_source_and_rate(row: Endpoint) -> None:
    match row.kind:
        case EndpointKind.TOPIC:
            TYPES.message(row.type)
        case EndpointKind.SERVICE:
            TYPES.service(row.type)
        case EndpointKind.ACTION:
            TYPES.message(f"{row.type}Action")
    assert row.about.endswith(".")
    assert row.source or not row.name.startswith("/ariac/"), (
        "give the original's plugin as source; names of additions begin with /cellwright/"
    )
    assert (row.rate is not None) == (row.direction is Direction.OUT)
    assert ("{" in row.name) == ("each" in row.where.text)


@pytest.mark.parametrize("competition", [False, True])
def test_bus_accepts_all_rows(competition: bool) -> None:
    bus = Bus(lambda: 0)
    for row in rows(WHOLE, competition=competition):
        if row.kind is EndpointKind.SERVICE:
            bus.serve(row.name, row.type, lambda _request, _node: None)
        elif row.kind is EndpointKind.TOPIC and row.direction is Direction.OUT:
            bus.advertise(row.name, row.type, latch=row.latch, rate=row.rate_text, node=row.node)
        elif row.kind is EndpointKind.TOPIC:
            bus.listen(row.name, row.type, lambda _message, _node: None, node=row.node)
    assert {info.name: info.type for info in bus.topics()} == {name: OUT[name][0] for name in OUT} | IN
    assert len(bus.services()) == len(SERVICES) - competition
    assert bus.topic("/tf").publishers == ("/robot_state_publisher", "/gazebo")


@pytest.mark.parametrize(
    ("name", "kind"), [("orders", "break_beam"), ("trays", "logical_camera"), ("arm/command", "laser_profiler")]
)
def test_sensor_with_topic_name_of_cell_is_refused(name: str, kind: SensorType) -> None:
    trial = Trial("", has_arm=True, sensors=(SensorConfig(name, kind, Pose()),))
    with pytest.raises(UsageError, match=f"sensor '{name}': topic /ariac/{name} already has type"):
        rows(trial, competition=False)


kinds = st.sampled_from(["break_beam", "proximity_sensor", "laser_profiler", "logical_camera"])


@pytest.mark.slow
@given(
    st.booleans(),
    st.booleans(),
    st.booleans(),
    st.lists(
        st.tuples(st.from_regex(r"[a-z]{1,8}_[0-9]", fullmatch=True), kinds), max_size=5, unique_by=lambda s: s[0]
    ),
    st.booleans(),
)
def test_rows_of_any_cell_are_filled_in(
    arm: bool, agvs: bool, belt: bool, sensors: list[tuple[str, SensorType]], competition: bool
) -> None:
    trial = Trial(
        "",
        has_arm=arm,
        options=Options(insert_agvs=agvs),
        belt_parts=WHOLE.belt_parts if belt else (),
        sensors=tuple(SensorConfig(name, kind, Pose()) for name, kind in sensors),
    )
    found = rows(trial, competition=competition)
    assert not any("{" in row.name for row in found)
    assert [row.name for row in found if row.name == "/ariac/orders"] == ["/ariac/orders"]
    for name, kind in sensors:
        mine = [row for row in found if row.subject == name]
        assert len(mine) == (2 if kind == "break_beam" else 1)
        assert mine[0].name == f"/ariac/{name}"
    assert sum(row.name.startswith("/ariac/arm/") for row in found) == (9 if arm else 0)
    assert ("/ariac/population/control" in {row.name for row in found}) == (belt and not competition)
