"""What a program that works the kit-building cell begins with: a class to inherit from, and four calls.

The names are those of the 2017 competition's example. Everything is ordinary rospy: call `rospy.init_node` first.
"""

from __future__ import annotations

import time
from typing import Any, Dict, List, Optional, Sequence, Type

import rospy
from osrf_gear.msg import Order, VacuumGripperState
from osrf_gear.srv import AGVControl, VacuumGripperControl
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

PRINT_PERIOD = 10.0
"""Time [s] on the wall clock between two lines about a topic that never stops."""

REACH_TIME = 1.0
"""Time [s] in which `send_arm_to_state` has the arm at its goal."""


def _call(name: str, service_class: Type[Any], *arguments: Any) -> Optional[Any]:
    """Wait for a service, and call it; None, with the reason logged, when the call fails."""
    rospy.loginfo("waiting for %s", name)
    rospy.wait_for_service(name)
    try:
        return rospy.ServiceProxy(name, service_class)(*arguments)
    except rospy.ServiceException as error:
        rospy.logerr("%s failed: %s", name, error)
        return None


def start_competition() -> bool:
    """Start the competition; whether it started."""
    answer = _call("/ariac/start_competition", Trigger)
    if answer is None:
        return False
    if answer.success:
        rospy.loginfo("the competition has started")
    else:
        rospy.logerr("the competition did not start: %s", answer.message)
    return bool(answer.success)


def control_gripper(enabled: bool) -> bool:
    """Switch the suction of the gripper on or off; whether it took."""
    answer = _call("/ariac/gripper/control", VacuumGripperControl, enabled)
    return answer is not None and bool(answer.success)


def control_agv(index: int, kit_type: str) -> bool:
    """Send an AGV (1 or 2) off with its tray as a kit (`order_0_kit_0`); whether it was ready to go."""
    answer = _call("/ariac/agv{}".format(index), AGVControl, kit_type)
    return answer is not None and bool(answer.success)


class MyCompetitionClass:
    """Keeps what the cell last said, and moves the arm. Inherit from it, and let its callbacks do more."""

    def __init__(self) -> None:
        self.joint_trajectory_publisher = rospy.Publisher("/ariac/arm/command", JointTrajectory, queue_size=10)
        self.current_comp_state: Optional[str] = None
        self.received_orders: List[Any] = []
        self.current_joint_state: Any = None
        self.current_gripper_state: Any = None
        self.last_joint_state_print = time.time()
        self.last_gripper_state_print = time.time()
        self.has_been_zeroed = False
        self.arm_joint_names = [
            "elbow_joint",
            "linear_arm_actuator_joint",
            "shoulder_lift_joint",
            "shoulder_pan_joint",
            "wrist_1_joint",
            "wrist_2_joint",
            "wrist_3_joint",
        ]

    def comp_state_callback(self, msg: Any) -> None:
        """Take the state of the competition."""
        if self.current_comp_state != msg.data:
            rospy.loginfo("competition state: %s", msg.data)
        self.current_comp_state = msg.data

    def order_callback(self, msg: Any) -> None:
        """Take an order."""
        rospy.loginfo("order received:\n%s", msg)
        self.received_orders.append(msg)

    def joint_state_callback(self, msg: Any) -> None:
        """Take the positions of the joints."""
        if time.time() - self.last_joint_state_print >= PRINT_PERIOD:
            rospy.loginfo("joint states, shown every %g s:\n%s", PRINT_PERIOD, msg)
            self.last_joint_state_print = time.time()
        self.current_joint_state = msg

    def gripper_state_callback(self, msg: Any) -> None:
        """Take the state of the gripper."""
        if time.time() - self.last_gripper_state_print >= PRINT_PERIOD:
            rospy.loginfo("gripper state, shown every %g s:\n%s", PRINT_PERIOD, msg)
            self.last_gripper_state_print = time.time()
        self.current_gripper_state = msg

    def send_arm_to_state(self, positions: Sequence[float]) -> None:
        """Send the arm to these positions [rad; m for the rail], in the order of `arm_joint_names`."""
        point = JointTrajectoryPoint()
        point.positions = list(positions)
        point.time_from_start = rospy.Duration(REACH_TIME)
        command = JointTrajectory()
        command.joint_names = self.arm_joint_names
        command.points = [point]
        rospy.loginfo("sending the arm to %s", point.positions)
        self.joint_trajectory_publisher.publish(command)


def connect_callbacks(comp_class: MyCompetitionClass) -> None:
    """Subscribe a competition class to the topics that it has callbacks for."""
    topics: Dict[str, Any] = {
        "/ariac/competition_state": (String, comp_class.comp_state_callback),
        "/ariac/orders": (Order, comp_class.order_callback),
        "/ariac/joint_states": (JointState, comp_class.joint_state_callback),
        "/ariac/gripper/state": (VacuumGripperState, comp_class.gripper_state_callback),
    }
    for name, (message_class, callback) in topics.items():
        rospy.Subscriber(name, message_class, callback)
