#!/usr/bin/env python3
"""Starts the competition, moves the arm to its zero position, and listens."""

import rospy
from ariac_example import ariac_example


def main() -> None:
    """Run the node until it is shut down."""
    rospy.init_node("ariac_example_node")
    competition = ariac_example.MyCompetitionClass()
    ariac_example.connect_callbacks(competition)
    ariac_example.start_competition()
    while competition.joint_trajectory_publisher.get_num_connections() == 0 and not rospy.is_shutdown():
        rospy.sleep(0.01)  # a command that nobody hears yet is lost
    if not competition.has_been_zeroed:
        competition.has_been_zeroed = True
        competition.send_arm_to_state([0.0] * len(competition.arm_joint_names))
    rospy.spin()


if __name__ == "__main__":
    main()
