#!/usr/bin/env python3
"""Brings two piston rods from bin 7 and two gears from the belt to AGV 1, and sends the AGV off."""

from copy import deepcopy

import rospy
from ariac_example import ariac_example as ariac
from osrf_gear.msg import Proximity
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

RAIL, SHOULDER_LIFT, SHOULDER_PAN = 1, 2, 3  # where these joints stand in a waypoint


class PerformTaskClass(ariac.MyCompetitionClass):
    def __init__(self):
        ariac.MyCompetitionClass.__init__(self)
        self.break_beam_state = False
        self.do_work = False
        self.fetch_from_bin = False
        self.fetch_from_belt = False
        self.has_zeroed_on_belt = False
        self.num_part_required = 0
        self.count = 0  # gears brought
        self.x_axis_step = 0.13  # from one rod in the bin to the next [m], and on the tray [rad]
        self.patience = rospy.get_param("~patience", 20.0)  # how long to wait for a gear [s]
        self.last_gear = None  # when the beam was last seen broken
        # In the order of arm_joint_names: elbow, rail, shoulder lift, shoulder pan, wrist 1, 2 and 3 [rad; m for the
        # rail]. The eighth number stands for the gripper, as in joint_states; the controller ignores it.
        self.waypoints = [
            [2.5, 0.0, -1.2, 3.20, 3.5, -1.51, 0.0, 0.0],  # 0: ready
            [2.09, 0.25, -0.47, 3.2, 3.1, -1.51, 0.0, 0.0],  # 1: on a piston rod of bin 7
            [2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0, 0.0],  # 2: lifted
            [2.5, 2.0, -1.0, 1.5, 3.0, -1.51, 0.0, 0.0],  # 3: beside AGV 1
            [1.02, 2.0, -0.27, 1.5, 4.0, -1.51, 0.0, 0.0],  # 4: over its tray
            [2.6, 2.0, -1.0, 3.2, 3.0, -1.51, 0.0, 0.0],  # 5: drawn back
            [2.6, 0.38, -1.0, 3.2, 3.0, -1.51, 0.0, 0.0],  # 6: above the bin again
            [2.7, 1.88, -1.5, 0.0, 3.5, -1.51, 0.0, 0.0],  # 7: beside the belt
            [1.7, 1.84, -0.8, 0.0, 3.7, -1.57, 0.0, 0.0],  # 8: over the belt, not used
            [1.65, 1.84, -0.7, 0.0, 3.7, -1.57, 0.0, 0.0],  # 9: on the belt
            [2.7, 1.84, -1.5, 1.5, 3.5, -1.51, 0.0, 0.0],  # 10: off the belt
        ]

    def beam_breaker_callback(self, message):
        self.break_beam_state = message.object_detected

    def joint_state_callback(self, message):  # the inherited two also print what they get, every ten seconds
        self.current_joint_state = message

    def gripper_state_callback(self, message):
        self.current_gripper_state = message

    def connect_callbacks(self):
        ariac.connect_callbacks(self)
        self.beam_sub = rospy.Subscriber("/ariac/break_beam", Proximity, self.beam_breaker_callback)
        while self.joint_trajectory_publisher.get_num_connections() == 0:  # a command before that would be lost
            rospy.sleep(0.1)

    def send_arm_to_state(self, positions):
        """Send the arm along waypoints, a second each."""
        message = JointTrajectory(joint_names=self.arm_joint_names)
        for number, goal in enumerate(positions, start=1):
            message.points.append(JointTrajectoryPoint(positions=goal, time_from_start=rospy.Duration(number)))
        self.joint_trajectory_publisher.publish(message)

    def main(self, _do_work=True, _fetch_from_bin=True, _fetch_from_belt=True, _num_parts=2):
        """Start the competition and move to the ready position."""
        self.connect_callbacks()
        ariac.start_competition()
        if not self.has_been_zeroed:
            self.has_been_zeroed = True
            self.send_arm_to_state([self.waypoints[0]])
            rospy.sleep(1.5)
        self.do_work = _do_work
        self.fetch_from_bin = _fetch_from_bin
        self.fetch_from_belt = _fetch_from_belt
        self.num_part_required = _num_parts

    def execute(self):
        """One turn: all the rods in the first one, then one gear if the beam is broken at this moment."""
        if not self.do_work:
            return
        if self.fetch_from_bin:
            for number in range(self.num_part_required):
                self.bring_rod(number)
            self.fetch_from_bin = False
        if self.fetch_from_belt and self.count < self.num_part_required:
            self.bring_gear()
        if not self.fetch_from_belt or self.count == self.num_part_required or self.is_out_of_patience():
            self.do_work = False
            rospy.loginfo("work completed, with %d of %d gears", self.count, self.num_part_required)
            self.send_arm_to_state([self.waypoints[0]])
            rospy.sleep(1.0)
            ariac.control_agv(1, "order_0_kit_0")

    def bring_rod(self, number):
        rospy.loginfo("fetching rod %d", number + 1)
        goal = deepcopy(self.waypoints[1])
        goal[RAIL] += self.x_axis_step * number
        self.send_arm_to_state([goal])
        rospy.sleep(1.0)
        ariac.control_gripper(True)
        rospy.sleep(0.2)
        rospy.loginfo("delivering it")
        self.send_arm_to_state(self.waypoints[2:5])
        rospy.sleep(3.0)
        ariac.control_gripper(False)
        rospy.sleep(0.2)
        rospy.loginfo("returning to the bin")
        self.send_arm_to_state([self.waypoints[5]])
        rospy.sleep(1.0)
        self.send_arm_to_state([self.waypoints[6]])
        rospy.sleep(1.0)

    def bring_gear(self):
        if not self.has_zeroed_on_belt:
            rospy.loginfo("taking up position by the belt")
            self.send_arm_to_state([self.waypoints[7]])
            rospy.sleep(1.5)
            self.has_zeroed_on_belt = True
            self.last_gear = rospy.get_time()
        if not self.break_beam_state:
            return
        self.last_gear = rospy.get_time()
        rospy.loginfo("the beam is broken: lowering")
        rospy.sleep(0.3)
        ariac.control_gripper(True)
        goal = deepcopy(self.waypoints[9])
        goal[SHOULDER_LIFT] = -0.66
        self.send_arm_to_state([goal])
        rospy.sleep(1.2)
        if not self.holds_a_part():
            return
        rospy.loginfo("lifting it off the belt")
        self.send_arm_to_state([self.waypoints[10]])
        rospy.sleep(1.0)
        if not self.holds_a_part():
            return
        rospy.loginfo("delivering gear %d", self.count + 1)
        goal = deepcopy(self.waypoints[4])
        goal[SHOULDER_PAN] = 1.65 - self.count * self.x_axis_step
        self.send_arm_to_state([goal])
        rospy.sleep(1.5)
        ariac.control_gripper(False)
        rospy.sleep(0.2)
        rospy.loginfo("returning to the belt")
        self.send_arm_to_state([self.waypoints[7]])
        rospy.sleep(1.0)
        self.count += 1

    def holds_a_part(self):
        """Return whether the cup holds a part; if not, move to where the arm waits for the next one."""
        if self.current_gripper_state.attached:
            return True
        rospy.loginfo("missed it")
        self.send_arm_to_state([self.waypoints[7]])
        rospy.sleep(0.5)
        return False

    def is_out_of_patience(self):
        return self.last_gear is not None and rospy.get_time() - self.last_gear > self.patience


if __name__ == "__main__":
    rospy.init_node("tasker")
    task = PerformTaskClass()
    task.main()
    rate = rospy.Rate(1)
    try:
        while task.do_work:
            task.execute()
            rate.sleep()
    except rospy.ROSInterruptException:
        pass
