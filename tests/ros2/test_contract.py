"""Interface for ROS 2 clients: names, types, quality of service and rates of tests/data/gear_ros1_cases.json."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cellwright.cell.interface.rows import CONTROLLER_NAMES, FOLLOW, rows
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.interface.table import EndpointKind
from tests.conftest import load_cases
from tests.ros2.ground import Ground, ground

pytestmark = pytest.mark.ros2

CASES = [case for case in load_cases("gear_ros1_cases.json") if not case["name"].startswith(f"{FOLLOW}/")]
TOPICS = {case["name"]: case for case in CASES if case["kind"] == "topic"}
SERVICES = {case["name"]: case for case in CASES if case["kind"] == "service"}
ROWS = {row.name: row for row in rows(load_trial([find_trial("lesson")]).trial, competition=False)}
STEPS, SECONDS = 500, 2
AT_ONCE = {("/tf", "/gazebo"): 4, ("/ariac/trays", ""): 2}
"""Messages that are published together, by topic and node in the original's graph: for each camera, for each tray."""
OWN = ("/rosout", "/parameter_events", "/robot_description", "/cellwright/", "/controller_manager/")
"""Topics that each node of ROS 2 has, and Cellwright's own."""


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Ground]:
    """The lesson in development mode, its competition not started."""
    with ground(tmp_path_factory.mktemp("contract")) as made:
        made.serve("lesson", "-d")
        yield made


@pytest.fixture(scope="module")
def graph(cell: Ground) -> dict[str, Any]:
    found: dict[str, Any] = cell.client(ask_graph).value()
    return found


def ask_graph() -> dict[str, Any]:
    """Return topics and services by name, and the ends of the cell's node at each topic."""
    from rclpy_node import Node

    with Node() as me:
        node = me.node
        me.wait(lambda: "cellwright" in node.get_node_names(), "node")  # its ends have no name before
        ends = {}
        for name, _ in node.get_topic_names_and_types():
            for direction, infos in (
                ("out", node.get_publishers_info_by_topic(name)),
                ("in", node.get_subscriptions_info_by_topic(name)),
            ):
                for info in infos:
                    if info.node_name == "cellwright":
                        qos = info.qos_profile
                        ends[name] = [direction, info.topic_type, qos.reliability.name, qos.durability.name]
        return {
            "topics": dict(node.get_topic_names_and_types()),
            "services": dict(node.get_service_names_and_types()),
            "ends": ends,
        }


def test_graph_has_names_of_contract_only(graph: dict[str, Any]) -> None:
    topics = {name for name in graph["topics"] if not name.startswith(OWN) and "/_action/" not in name}
    others = {other for name, other in CONTROLLER_NAMES.items() if name in TOPICS}
    assert topics == {*TOPICS, *others}
    for name, other in ((name, other) for name, other in CONTROLLER_NAMES.items() if "{" not in name):
        for kind in ("topics", "services"):
            assert graph[kind].get(other) == graph[kind].get(name)
    services = [name for name in graph["services"] if name.startswith("/ariac/") and "/_action/" not in name]
    assert sorted(services) == sorted(SERVICES)
    actions = [name for name in graph["topics"] if name.endswith("/_action/status")]
    expected = (FOLLOW, CONTROLLER_NAMES[FOLLOW], "/simulate_steps")
    assert sorted(actions) == sorted(f"{name}/_action/status" for name in expected)


@pytest.mark.parametrize("name", sorted(TOPICS))
def test_topic_has_type_direction_and_quality_of_contract(graph: dict[str, Any], name: str) -> None:
    direction, type_name, reliability, durability = graph["ends"][name]
    case, row = TOPICS[name], ROWS[name]
    assert (direction, type_name) == (case["direction"], case["type"].replace("/", "/msg/"))
    assert (reliability == "RELIABLE") == row.qos.is_reliable
    assert (durability == "TRANSIENT_LOCAL") == (case.get("latch", False) and direction == "out")


@pytest.mark.parametrize("name", sorted(SERVICES))
def test_service_has_type_of_contract(graph: dict[str, Any], name: str) -> None:
    assert graph["services"][name] == [SERVICES[name]["type"].replace("/", "/srv/")]
    assert ROWS[name].kind is EndpointKind.SERVICE


def count_messages(topics: dict[str, list[Any]], seconds: int) -> dict[str, int]:
    """Return the number of messages on each topic, with its type and quality, in some simulated seconds of lockstep."""
    from rclpy_node import BEST_EFFORT, LATCHED, MANY, Node

    with Node() as me:
        qos = {"latched": LATCHED, "many": MANY, "best effort": BEST_EFFORT}
        found = {name: me.listen(name, kind, qos[quality]) for name, (kind, quality) in topics.items()}
        me.wait(lambda: all(me.node.count_publishers(name) for name in topics), "publisher of each topic")

        def step(duration: float, **subscribed: Any) -> dict[str, int]:
            from builtin_interfaces.msg import Duration

            length = Duration(sec=int(duration), nanosec=round(duration % 1 * 1e9))
            answer = me.call("/cellwright/step", "cellwright_msgs/Step", duration=length, **subscribed)
            assert answer.success, answer.message
            return dict(zip(answer.topics, answer.sent, strict=True))

        before = step(0.01, topics=list(topics), published=[1] * len(topics))  # which waits for the subscribers
        me.wait(lambda: len(found["/clock"]) > 0, "clock")
        after = before
        for _ in range(10 * seconds):
            after = step(0.1)
        me.wait(lambda: len(found["/clock"]) >= after["/clock"] - before.get("/clock", 0), "last message")
        return {name: after.get(name, 0) - before.get(name, 0) for name in topics} | {"received": len(found["/clock"])}


def test_topics_have_rates_of_contract(tmp_path: Path) -> None:
    said = {name: case for name, case in TOPICS.items() if case["direction"] == "out" and case["rate"] is not None}
    with ground(tmp_path) as made:
        made.serve("lesson", "-d", "--lockstep")
        topics = {name: [case["type"], "latched" if case.get("latch") else "many"] for name, case in said.items()}
        found = made.client(count_messages, topics, SECONDS).value()
    assert found["received"] >= found["/clock"]
    for name, case in said.items():
        rates = case["rate"] if isinstance(case["rate"], dict) else {"": case["rate"]}
        expected = sum(
            (STEPS if rate == "step" else float(rate)) * AT_ONCE.get((name, node), 1) for node, rate in rates.items()
        )
        assert found[name] == pytest.approx(expected * SECONDS, rel=0.05, abs=1.5), name
