"""The things on the floor, one file each: belt, gripper, AGVs, arm, sensors. They speak SI units."""
