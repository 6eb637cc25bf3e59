"""Simulation engine: the clock, the event queue, stepping, snapshots and the state hash. Knows no ROS and no score."""
