"""The controller node as the public instructions print it, written for PyBullet: typed as it stands, it drives a robot.

Only its indentation, which the page loses, was restored. It imports messages without a public definition, which its
users bring along; here they are empty classes. The window of PyBullet is left out, since it requires a display.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from cellwright.middleware.ros1.packages.contents import IO_TELEOP, write_package
from tests.ros1.ground import Ground
from tests.ros1.requirement import ros_python
from tests.support.waiting import TIMEOUT, wait_until

pytest_plugins = ["tests.ros1.fixtures"]
PRINTED = Path(__file__).parents[1] / "data" / "printed_controller_node.txt"
MESSAGES = {"udp_ros_node": ("PuppetState",), "my_listener_package": ("AlohaCmd", "vp_control", "headcontrol")}


@pytest.fixture
def libraries(tmp_path: Path, ros1_messages: Path) -> str:
    """Search path of the script: the user's messages, and PyBullet for the system's Python."""
    found = find_spec("pybullet")
    if found is None or found.origin is None:
        pytest.skip("PyBullet is not installed")
    folder = tmp_path / "libraries"
    for package, names in MESSAGES.items():
        (folder / package).mkdir(parents=True)
        (folder / package / "__init__.py").touch()
        (folder / package / "msg.py").write_text("".join(f"class {name}: pass\n" for name in names))
    (folder / Path(found.origin).name).symlink_to(found.origin)
    return f"{ros1_messages}:{folder}"


def work() -> dict[str, object]:
    import rospy
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    rospy.init_node("client")
    seen: dict[str, float] = {}
    rospy.Subscriber("/io_teleop/joint_states", JointState, lambda m: seen.update(zip(m.name, m.position, strict=True)))

    def out(name: str) -> rospy.Publisher:
        publisher = rospy.Publisher(f"/io_teleop/{name}", JointState, queue_size=10)
        wait_until(publisher.get_num_connections, "connection")
        return publisher

    def wait(name: str, value: float) -> bool:
        return wait_until(lambda: abs(seen.get(name, 99.0) - value) <= 0.01, name, seen=lambda: seen.get(name))

    out("joint_cmd").publish(JointState(name=["J_arm_l_04"], position=[1.0]))
    out("target_joint_from_vr").publish(JointState(name=["J_head_yaw"], position=[0.4]))
    out("target_gripper_status").publish(JointState(position=[0.0, 1.0]))
    moved = wait("J_arm_l_04", 1.0) and wait("J_head_yaw", 0.4) and wait("lh_FFJ3", 1.571)
    rospy.wait_for_service("/io_teleop_reset_robot", TIMEOUT)
    answer = rospy.ServiceProxy("/io_teleop_reset_robot", Trigger)()
    return {"joints": len(seen), "moved": moved, "answer": answer.message, "home": wait("J_arm_l_04", 1.7)}


@pytest.mark.ros1
@pytest.mark.slow
@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="PyBullet here is for another Python than the system's")
def test_printed_node_drives_robot(master: Ground, tmp_path: Path, libraries: str) -> None:
    package = tmp_path / IO_TELEOP
    write_package(IO_TELEOP, package, tmp_path / "bin")
    script = package / "scripts" / "openloong_controller_node.py"
    text = PRINTED.read_text(encoding="utf-8")
    assert text.count("without_gui = False") == 1
    script.write_text(text.replace("without_gui = False", "without_gui = True"), encoding="utf-8")
    python = ros_python()
    assert python is not None
    node = master.start([python, str(script)], PYTHONPATH=libraries)
    assert master.client(work).value() == {
        "joints": 75,
        "moved": True,
        "answer": "Service successfully triggered!",
        "home": True,
    }
    listed = master.tool("rostopic", "list").split()
    names = ("joint_cmd", "joint_states", "target_gripper_status", "target_joint_from_vr")
    assert {f"/io_teleop/{name}" for name in names} <= set(listed)
    node.interrupt()
