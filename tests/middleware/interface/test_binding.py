"""Binding of tables: rows on a bus, each with its handler."""

import subprocess
import sys

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.interface.action_server import ActionServer
from cellwright.cell.interface.commands import CellCommands
from cellwright.cell.interface.controllers import ControllerServices
from cellwright.cell.interface.publications import CellPublications
from cellwright.cell.interface.rows import GEAR, PICTURES
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import BEST_EFFORT_COMMANDS, COMMANDS, LARGE, LATCHED, RELIABLE, Bus, Qos
from cellwright.middleware.interface.binding import Output, bind
from cellwright.middleware.interface.notes import Notes
from cellwright.middleware.interface.table import ALWAYS, Endpoint, EndpointKind, Timing, accepts, publishes
from cellwright.middleware.messages.standard import Float64
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.robot.commands import BaseCommands, RobotCommands
from cellwright.robot.ee_poses import EePoses
from cellwright.robot.homing import Homing
from cellwright.robot.interface import IO_TELEOP, JOINT_SOURCES
from cellwright.robot.publications import CameraTopics, RobotPublications
from cellwright.util.errors import UsageError
from tests.support.cells import BARE

STATE = publishes("/state", "std_msgs/Float64", 100, ALWAYS, "Time.", node="/node", handler="state")
COMMAND = accepts(
    EndpointKind.TOPIC, "/command_{n}", "std_msgs/Float64", ALWAYS, "A number.", node="/node", handler="command"
).of("7")
ASK = accepts(EndpointKind.SERVICE, "/ask", "std_srvs/Trigger", ALWAYS, "An answer.", handler="ask")
ACTION = accepts(EndpointKind.ACTION, "/act", "control_msgs/FollowJointTrajectory", ALWAYS, "Five topics.")


class Handlers:
    """Handlers that record their calls."""

    def __init__(self) -> None:
        self.heard: list[tuple[str, float, str]] = []
        self.ranks: list[int] = []

    def state(self, output: Output) -> None:
        self.ranks.append(output.rank)
        output.sample(lambda: Float64(output.simulation.time))

    def command(self, row: Endpoint, message: Float64, node: str) -> None:
        self.heard.append((row.name, message.data, node))


class Services:
    """Another object with handlers."""

    def ask(self, row: Endpoint, _request: TriggerRequest, node: str) -> TriggerResponse:
        return TriggerResponse(success=True, message=f"{row.name} from {node}")


@pytest.fixture
def simulation() -> Simulation:
    return Cell(BARE).simulation


def test_row_is_bound_to_named_handler(simulation: Simulation) -> None:
    bus, handlers = Bus(lambda: simulation.now), Handlers()
    bind(bus, simulation, (ACTION, COMMAND, ASK, STATE), (handlers, Services()))
    said: list[Float64] = []
    bus.subscribe("/state", said.append)
    bus.publish("/command_7", Float64(3.0), node="/me")
    for _ in range(10):
        simulation.step()
    assert handlers.heard == [("/command_7", 3.0, "/me")]
    assert handlers.ranks == [4]  # its place in the table
    assert bus.call("/ask", TriggerRequest(), node="/me").message == "/ask from /me"
    assert said == [Float64(0.01), Float64(0.02)]
    assert bus.topic("/state").publishers == bus.topic("/command_7").subscribers == ("/node",)


@pytest.mark.parametrize("row", [STATE, COMMAND, ASK])
def test_row_without_handler_is_refused(simulation: Simulation, row: Endpoint) -> None:
    with pytest.raises(UsageError, match=f"{row.name}: no handler is named '{row.handler}'"):
        bind(Bus(lambda: simulation.now), simulation, [row], ())


@pytest.mark.parametrize(
    ("type_name", "latch", "expected"),
    [
        ("std_msgs/Float64", False, RELIABLE),
        ("osrf_gear/Order", True, LATCHED),
        ("sensor_msgs/Image", False, LARGE),
        ("sensor_msgs/CameraInfo", False, RELIABLE),
        ("sensor_msgs/PointCloud2", False, LARGE),
    ],
)
def test_row_without_qos_has_default_of_its_type(type_name: str, latch: bool, expected: Qos) -> None:
    assert publishes("/x", type_name, Timing.ON_EVENT, ALWAYS, "", latch=latch).qos == expected
    assert publishes("/x", type_name, 1, ALWAYS, "", latch=latch, qos=Qos(depth=3)).qos == Qos(depth=3)


def test_qos_text_names_reliability_durability_and_depth() -> None:
    assert [each.text for each in (RELIABLE, LATCHED, COMMANDS, BEST_EFFORT_COMMANDS)] == [
        "reliable, depth 10",
        "reliable, transient local, depth 1",
        "reliable, depth 1000",
        "best effort, depth 1000",
    ]


def test_joint_sources_keep_order_for_saved_states() -> None:
    assert tuple(name.removeprefix("/io_teleop/") for name in JOINT_SOURCES) == (
        "joint_cmd",
        "target_joint_from_vr",
        "target_gripper_status",
        "target_finger_joints",
        "joint_cmd_finger_left",
        "joint_cmd_finger_right",
        "target_ee_poses",
    )


@pytest.mark.parametrize("module", ["cellwright.cell.interface.rows", "cellwright.robot.interface"])
def test_tables_are_imported_without_engine(module: str) -> None:
    code = f"import sys, {module}; sys.exit('mujoco' in sys.modules or 'cellwright.engine' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    ("table", "classes"),
    [
        ((*GEAR, *PICTURES), (CellCommands, CellPublications, ActionServer, ControllerServices, Notes)),
        (IO_TELEOP, (RobotCommands, BaseCommands, Homing, EePoses, RobotPublications, CameraTopics, Notes)),
    ],
    ids=["cell", "robot"],
)
def test_handlers_and_rows_of_table_match(table: tuple[Endpoint, ...], classes: tuple[type, ...]) -> None:
    named = {row.handler for row in table if row.kind is not EndpointKind.ACTION}
    takers = {
        name
        for each in classes
        for name, method in vars(each).items()
        if {"row", "_row", "output"}
        & set(getattr(getattr(getattr(method, "func", method), "__code__", None), "co_varnames", ()))
        if not name.startswith("_")
    }
    assert takers - {"refuse", "silence"} == named - {"clock"}
    assert any(hasattr(each, "clock") for each in classes)
