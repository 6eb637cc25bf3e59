"""Cell of one's own over ROS 1: a rospy program finds its topics, types, services and frames, and works with them."""

from pathlib import Path
from typing import Any

import pytest

from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

CELL = Path(__file__).parents[1] / "data" / "own_cell.yaml"
TOPICS = {
    "/ariac/agv1/state": "std_msgs/String",
    "/ariac/table/state": "std_msgs/String",
    "/ariac/logical_camera_near": "osrf_gear/LogicalCameraImage",
    "/ariac/beam": "osrf_gear/Proximity",
    "/ariac/population_back/state": "osrf_gear/PopulationState",
}
SERVICES = {
    "/ariac/agv1": "osrf_gear/AGVControl",
    "/ariac/table": "osrf_gear/AGVControl",
    "/ariac/conveyor_front/control": "osrf_gear/ConveyorBeltControl",
    "/ariac/conveyor_back/control": "osrf_gear/ConveyorBeltControl",
    "/ariac/population_back/control": "osrf_gear/PopulationControl",
    "/ariac/kit_tray_2/clear_tray": "std_srvs/Trigger",
    "/cellwright/layout": "std_srvs/Trigger",
}
FRAMES = {
    "near_frame": (-0.35, -0.8, 0.72),
    "table_frame": (0.3, -3.0, 0.75),
    "front_frame": (1.1, 0.25, 0.9),
    "back_frame": (-0.9, -0.25, 0.8),
    "beam_frame": (1.41, 0.75, 0.903),
}


def program(services: list[str], frames: list[str]) -> dict[str, Any]:
    import json

    import rospy
    import rosservice
    import tf2_ros
    from osrf_gear.msg import ConveyorBeltState, LogicalCameraImage
    from osrf_gear.srv import AGVControl, ConveyorBeltControl
    from std_msgs.msg import String
    from std_srvs.srv import Trigger

    rospy.init_node("team")
    states: list[str] = []
    images: list[Any] = []
    rospy.Subscriber("/ariac/table/state", String, lambda m: states.append(m.data))
    rospy.Subscriber("/ariac/logical_camera_near", LogicalCameraImage, images.append)
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)
    for name in services:
        rospy.wait_for_service(name)

    def place(frame: str) -> tuple[float, float, float]:
        wait_until(lambda: buffer.can_transform("world", frame, rospy.Time()), f"frame {frame}")
        at = buffer.lookup_transform("world", frame, rospy.Time()).transform.translation
        return at.x, at.y, at.z

    found = {name: place(name) for name in frames}
    wait_until(lambda: images and len(images[-1].models) == 4, "four gears over the bin")
    rospy.ServiceProxy("/ariac/start_competition", Trigger)()
    belt = rospy.ServiceProxy("/ariac/conveyor_back/control", ConveyorBeltControl)
    sent = rospy.ServiceProxy("/ariac/table", AGVControl)("order_0_kit_0").success
    wait_until(lambda: "preparing_to_deliver" in states and states[-1] == "ready_to_deliver", "a submitted kit")
    layout = json.loads(rospy.ServiceProxy("/cellwright/layout", Trigger)().message)
    return {
        "topics": dict(rospy.get_published_topics()),
        "services": {name: rosservice.get_service_type(name) for name in services},
        "frames": found,
        "belt": belt(ConveyorBeltState(power=50.0)).success,
        "sent": sent,
        "belts": [each["name"] for each in layout["belts"]],
        "listener": listener is not None,
    }


def test_program_finds_and_uses_what_an_own_cell_has(master: Ground) -> None:
    master.serve(str(CELL), "-d")
    found = master.client(program, list(SERVICES), list(FRAMES)).value()
    assert {name: found["topics"].get(name) for name in TOPICS} == TOPICS
    assert not [name for name in found["topics"] if "agv2" in name or "/conveyor/" in name]
    assert found["services"] == SERVICES
    for name, place in FRAMES.items():
        assert found["frames"][name] == pytest.approx(place, abs=1e-3)
    assert (found["belt"], found["sent"], found["belts"]) == (True, True, ["front", "back"])
