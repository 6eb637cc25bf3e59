"""Pictures for programs of ROS 1."""

from typing import Any

import pytest

from tests.ros1.ground import Ground
from tests.support.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

CELL = """
cellwright:
  sensors:
    over:
      type: rgbd_camera
      pose: {xyz: [-0.3, 0.23, 1.4], rpy: [0, pi/2, 0]}
      noise: {colour: 0, depth: 0, depth_growth: 0}
      width: 160
      height: 120
    old:
      type: depth_camera
      pose: {xyz: [-0.3, 0.23, 1.4], rpy: [0, pi/2, 0]}
      width: 88
      height: 72
"""


def look() -> dict[str, Any]:
    """Return a message of each topic of two cameras, as rospy gets them, in numbers."""
    import struct

    import rospy
    from sensor_msgs.msg import CameraInfo, Image, PointCloud, PointCloud2

    rospy.init_node("looker")

    topics = {
        "/ariac/over/image_raw": Image,
        "/ariac/over/camera_info": CameraInfo,
        "/ariac/over/depth/image_raw": Image,
        "/ariac/over/depth/points": PointCloud2,
        "/ariac/old": PointCloud,
    }
    came: dict[str, Any] = {}
    for topic, kind in topics.items():
        rospy.Subscriber(topic, kind, lambda message, topic=topic: came.setdefault(topic, message))
    wait_until(lambda: len(came) == len(topics), "picture of each kind", seen=lambda: sorted(came))
    colour, info, depth, points, cloud = (came[topic] for topic in topics)
    middle = 160 * 60 + 80
    return {
        "colour": [colour.width, colour.height, colour.encoding, colour.step, len(colour.data)],
        "frame": colour.header.frame_id,
        "matrix": list(info.K),
        "depth": struct.unpack_from("<f", depth.data, 4 * middle)[0],
        "point": struct.unpack_from("<fff", points.data, points.point_step * middle),
        "fields": [field.name for field in points.fields],
        "cloud": [len(cloud.points), cloud.header.frame_id, cloud.points[0].x],
    }


def test_camera_subscriber_gets_pictures(master: Ground) -> None:
    file = master.folder / "cameras.yaml"
    file.write_text(CELL)
    master.serve(str(file), "-d")
    found = master.client(look).value()
    assert found["colour"] == [160, 120, "rgb8", 480, 57600]
    assert found["frame"] == "over_optical_frame"
    assert found["matrix"][0] == found["matrix"][4] == pytest.approx(80 / 0.5772, rel=0.01)
    assert found["matrix"][2] == 79.5
    assert found["depth"] == pytest.approx(1.4 - 0.725, abs=0.002)
    assert found["point"] == pytest.approx([0.0, 0.0, 1.4 - 0.725], abs=0.003)
    assert found["fields"] == ["x", "y", "z", "rgb"]
    count, frame, ahead = found["cloud"]
    assert (count, frame) == (88 * 72, "old_frame")
    assert 0.4 < ahead < 1.5
