"""ROS 1: a bridge carries a cell's bus to ROS and back; it only forwards bytes.

The bridge is a process under another interpreter, which needs nothing of Cellwright installed. It connects to the
cell's server like any other client, and imports nothing but `cellwright.middleware.wire`.
"""
