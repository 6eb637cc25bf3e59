"""Devices of the cell: belt, gripper, AGVs, arm and sensors, in SI units."""
