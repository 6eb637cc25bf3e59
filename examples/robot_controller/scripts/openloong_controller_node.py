#!/usr/bin/env python3
"""A controller node of one's own: start yours from here.

It has the four topics and the service of the io_teleop stack, and one topic that no other node has: /openloong/look
turns the head. The robot is put up and moved by AssembledRobot; nothing here knows of an engine.
"""

import os
import sys
import threading
import time

import rospkg
import rospy
import yaml
from geometry_msgs.msg import Vector3
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger, TriggerResponse

PACKAGE = rospkg.RosPack().get_path("io_teleop_robot_control_node")  # `cellwright ros1-env` puts it on the path
sys.path.append(PACKAGE)

from io_teleop_robot_utils.robot_module import AssembledRobot  # noqa: E402


class OpenLoongController(AssembledRobot):
    def __init__(self, config_path, init_debug=False):
        descriptions = os.path.join(PACKAGE, "io_teleop_robot_descriptions")
        with open(os.path.join(descriptions, config_path)) as file:
            self.configs = yaml.safe_load(file)
        urdf = os.path.join(descriptions, os.path.dirname(config_path), self.configs["urdf_path"])
        AssembledRobot.__init__(self, urdf, self.configs, init_debug, self.configs.get("wo_controller", False))

        self.joint_state_pub = rospy.Publisher("/io_teleop/joint_states", JointState, queue_size=1)
        rospy.Subscriber("/io_teleop/joint_cmd", JointState, self.joint_cmd_callback)
        rospy.Subscriber("/io_teleop/target_joint_from_vr", JointState, self.joint_cmd_callback)
        rospy.Subscriber("/io_teleop/target_gripper_status", JointState, self.gripper_status_callback)
        rospy.Subscriber("/openloong/look", Vector3, self.look_callback)  # the topic of our own
        rospy.Service("io_teleop_reset_robot", Trigger, self.reset_callback)
        threading.Thread(target=self.publish_joint_states, daemon=True).start()

    def publish_joint_states(self):
        """Tell a hundred times a second where all joints are."""
        rate = rospy.Rate(100)
        while not rospy.is_shutdown():
            states = self.joint_states()
            message = JointState()
            message.header.stamp = rospy.Time.now()
            message.name = states.names
            message.position, message.velocity, message.effort = states.positions, states.velocities, states.efforts
            self.joint_state_pub.publish(message)
            try:
                rate.sleep()
            except rospy.ROSInterruptException:
                break

    def joint_cmd_callback(self, msg):
        """Go to positions by name, of any joints; names of another robot are left out."""
        for name, pos in zip(msg.name, msg.position):
            if name in self.joint_name2id_dict:
                self.move_j([self.joint_name2id_dict[name]], [pos])

    def gripper_status_callback(self, msg):
        """Close the grippers so far: right, left."""
        for gripper, status in zip(self.grippers, msg.position):
            gripper.move(status)

    def look_callback(self, msg):
        """Turn the head: roll, pitch, yaw [rad]."""
        self.head.move([msg.x, msg.y, msg.z])

    def reset_callback(self, _request):
        """Go home, and answer a second later."""
        self.reset_home()
        time.sleep(1)
        return TriggerResponse(success=True, message="Service successfully triggered!")


if __name__ == "__main__":
    rospy.init_node("openloong_controller_node")
    robot = OpenLoongController("OpenLoong/vr_configs.yml")
    rospy.loginfo("ready: %d joints", len(robot.joint_states().names))
    rospy.spin()
