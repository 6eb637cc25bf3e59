"""Interface of a robot's node for ROS 2 clients: names, types, quality of service and rates of its table."""

import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from cellwright.config.robot.robots import load_robot
from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import Endpoint, EndpointKind, Timing
from cellwright.robot.interface import CONTROLLER_NAMES, IO_TELEOP, NODE, rows
from tests.ros2.ground import Ground, ground
from tests.ros2.test_contract import count_messages

pytestmark = pytest.mark.ros2

CAMERA = "cameras: [{name: front, img_width: 32, img_height: 24}]\n"
STEPS, SECONDS = 240, 1
FOUND = load_robot("tandem", print)
ROWS = {row.name: row for row in rows(FOUND, cameras=["front"], sim_time=True)}
TOPICS = {name: row for name, row in ROWS.items() if row.kind is EndpointKind.TOPIC}
SERVICES = {name: row for name, row in ROWS.items() if row.kind is EndpointKind.SERVICE}


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ground]:
    """A robot that has everything of the table: two arms, grippers, a free base and a camera; in lockstep."""
    folder = tmp_path_factory.mktemp("robot")
    shutil.copytree(FOUND.path.parent, folder / "tandem")
    config = folder / "tandem" / "vr_configs.yml"
    config.write_text(config.read_text() + CAMERA)
    with ground(folder) as made:
        made.teleop(str(config), "--lockstep")
        yield made


@pytest.fixture(scope="module")
def graph(robot: Ground) -> dict[str, Any]:
    found: dict[str, Any] = robot.client(ask_graph, NODE.strip("/"), len(TOPICS) + len(SERVICES)).value()
    return found


def ask_graph(name: str, count: int) -> dict[str, Any]:
    """Return topics and services of a node by their names, once it has a number of them."""
    from rclpy_node import Node

    with Node() as me:
        node = me.node
        me.wait(lambda: name in node.get_node_names(), "node")

        def ends() -> dict[str, list[str]]:
            found = {}
            for topic, _ in node.get_topic_names_and_types():
                out, taken = node.get_publishers_info_by_topic(topic), node.get_subscriptions_info_by_topic(topic)
                for direction, infos in (("out", out), ("in", taken)):
                    for info in infos:
                        if info.node_name == name:
                            qos = info.qos_profile
                            found[topic] = [direction, info.topic_type, qos.reliability.name, qos.durability.name]
            return found

        def services() -> dict[str, list[str]]:
            return dict(node.get_service_names_and_types_by_node(name, "/"))

        me.wait(lambda: len(ends()) + len(services()) >= count, "topics and services")
        return {"ends": ends(), "services": services()}


def test_table_is_whole() -> None:
    assert {row.handler for row in IO_TELEOP} == {row.handler for row in ROWS.values()}


def test_node_has_topics_and_services_of_table_only(graph: dict[str, Any]) -> None:
    own = ("/rosout", "/parameter_events", "/robot_description", "/simulate_steps/")
    assert {name for name in graph["ends"] if not name.startswith(own)} == {*TOPICS, *CONTROLLER_NAMES.values()}
    of_every_node = (f"{NODE}/", "/simulate_steps/")
    services = {
        name
        for name, types in graph["services"].items()
        if not name.startswith(of_every_node) and not types[0].startswith("simulation_interfaces/")
    }
    assert services == {*SERVICES, "/cellwright/step"}


@pytest.mark.parametrize("name", TOPICS)
def test_topic_has_type_direction_and_quality_of_table(graph: dict[str, Any], name: str) -> None:
    row = TOPICS[name]
    direction = "out" if row.direction is Direction.OUT else "in"
    reliability = "RELIABLE" if row.qos.is_reliable else "BEST_EFFORT"
    durability = "TRANSIENT_LOCAL" if row.latch else "VOLATILE"
    assert graph["ends"][name] == [direction, row.type.replace("/", "/msg/"), reliability, durability]
    if name in CONTROLLER_NAMES:
        assert graph["ends"][CONTROLLER_NAMES[name]] == graph["ends"][name]


@pytest.mark.parametrize("name", SERVICES)
def test_service_has_type_of_table(graph: dict[str, Any], name: str) -> None:
    assert graph["services"][name] == [SERVICES[name].type.replace("/", "/srv/")]


def rate(row: Endpoint) -> float | None:
    """Return the messages of a topic in a simulated second; None if they come on events."""
    if isinstance(row.rate, Timing):
        return STEPS if row.rate is Timing.EACH_STEP else None
    return None if row.rate is None else float(row.rate)


def test_topics_have_rates_of_table(robot: Ground) -> None:
    said = {name: each for name, row in TOPICS.items() if row.direction is Direction.OUT and (each := rate(row))}
    kinds = {name: [TOPICS[name].type, "many" if TOPICS[name].qos.is_reliable else "best effort"] for name in said}
    found = robot.client(count_messages, kinds, SECONDS).value()
    assert found["received"] >= found["/clock"]
    for name, expected in said.items():
        assert found[name] == pytest.approx(expected * SECONDS, rel=0.05, abs=1.0), name
