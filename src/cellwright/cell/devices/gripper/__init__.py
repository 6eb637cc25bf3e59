"""The vacuum gripper: what it sees, holds and lets go."""
