"""Cell of one's own over ROS 2: an rclpy program finds its topics, types, services and frames, and works with them."""

from pathlib import Path
from typing import Any

import pytest

from tests.ros2.ground import Ground

pytest_plugins = ["tests.ros2.fixtures"]

pytestmark = pytest.mark.ros2

CELL = Path(__file__).parents[1] / "data" / "own_cell.yaml"
TOPICS = {
    "/ariac/agv1/state": "std_msgs/msg/String",
    "/ariac/table/state": "std_msgs/msg/String",
    "/ariac/logical_camera_near": "osrf_gear/msg/LogicalCameraImage",
    "/ariac/beam": "osrf_gear/msg/Proximity",
    "/ariac/population_back/state": "osrf_gear/msg/PopulationState",
}
SERVICES = {
    "/ariac/agv1": "osrf_gear/srv/AGVControl",
    "/ariac/table": "osrf_gear/srv/AGVControl",
    "/ariac/conveyor_front/control": "osrf_gear/srv/ConveyorBeltControl",
    "/ariac/conveyor_back/control": "osrf_gear/srv/ConveyorBeltControl",
    "/cellwright/layout": "std_srvs/srv/Trigger",
}
FRAMES = {
    "near_frame": [-0.35, -0.8, 0.72],
    "table_frame": [0.3, -3.0, 0.75],
    "front_frame": [1.1, 0.25, 0.9],
    "back_frame": [-0.9, -0.25, 0.8],
}


def program(topics: list[str], services: list[str]) -> dict[str, Any]:
    import json

    from rclpy_node import LATCHED, MANY, Node

    with Node() as me:
        states = me.listen("/ariac/table/state", "std_msgs/String", MANY)
        images = me.listen("/ariac/logical_camera_near", "osrf_gear/LogicalCameraImage")
        tf = me.listen("/tf_static", "tf2_msgs/TFMessage", LATCHED)
        me.wait(lambda: {*topics} <= {name for name, _ in me.node.get_topic_names_and_types()}, "topics")
        me.wait(lambda: {*services} <= {name for name, _ in me.node.get_service_names_and_types()}, "services")
        me.wait(lambda: images and len(images[-1].models) == 4, "four gears over the bin")
        me.wait(lambda: tf, "static frames")
        me.call("/ariac/start_competition", "std_srvs/Trigger")
        sent = me.call("/ariac/table", "osrf_gear/AGVControl", kit_type="order_0_kit_0").success
        words = ["preparing_to_deliver", "ready_to_deliver"]
        me.wait(lambda: words[0] in [each.data for each in states] and states[-1].data == words[1], "a submitted kit")
        layout = json.loads(me.call("/cellwright/layout", "std_srvs/Trigger").message)
        placed = {each.child_frame_id: each.transform.translation for message in tf for each in message.transforms}
        return {
            "topics": {name: types[0] for name, types in me.node.get_topic_names_and_types()},
            "services": {name: types[0] for name, types in me.node.get_service_names_and_types()},
            "frames": {name: [at.x, at.y, at.z] for name, at in placed.items()},
            "sent": sent,
            "trays": [each["name"] for each in layout["trays"]],
        }


def test_program_finds_and_uses_what_an_own_cell_has(domain: Ground) -> None:
    domain.serve(str(CELL), "-d")
    found = domain.client(program, list(TOPICS), list(SERVICES)).value()
    assert {name: found["topics"].get(name) for name in TOPICS} == TOPICS
    assert not [name for name in found["topics"] if "agv2" in name or "/conveyor/" in name]
    assert {name: found["services"].get(name) for name in SERVICES} == SERVICES
    for name, place in FRAMES.items():
        assert found["frames"][name] == pytest.approx(place, abs=1e-3)
    assert (found["sent"], found["trays"]) == (True, ["table"])
