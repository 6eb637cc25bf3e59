"""ROS 1: a real node, by rospy's hand where it registers and answers the master, by ours where messages flow.

Two programs start here, both by the path of their file under the python3 that has rospy: `bridge.py` makes a served
cell the node `/gazebo`, and a served robot a node as it is told; `relay.py` is the way of a client that has no rospy to
either in ROS.

rospy gives every subscriber and every service connection a thread, which costs more than carrying the bytes does. So
it is left with what is rare (registering, parameters, logs, following the publishers of commands), while one loop in
the main thread (`loop.py`) accepts connections, answers handshakes and carries all that leaves the cell.
"""
