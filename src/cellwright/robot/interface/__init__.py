"""The contract of a robot's controller node: its table, its page and its parameters."""
