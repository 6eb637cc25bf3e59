"""ROS 1 node: rospy registers it and answers the master; Cellwright's own loop carries the messages.

Two programs start here, both by the path of their file under the python3 that has rospy. The bridge (`bridge.py`)
presents a served cell or robot as a node with a given name. The relay (`relay.py`)
connects a client without rospy to either in ROS.

rospy gives every subscriber and every service connection a thread, which costs more than carrying the bytes. So it does
only what is rare: registration, parameters, logs, following the publishers of commands. One loop in the main thread
(`loop.py`) accepts connections, answers handshakes and carries all that leaves the cell.
"""
