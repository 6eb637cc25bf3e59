"""What stands between a command and a robot: whose it is, how old, how far and how fast."""
