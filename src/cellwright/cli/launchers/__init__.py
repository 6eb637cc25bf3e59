"""Launchers with the command lines of other projects, in front of `cellwright serve` and `teleop`."""
