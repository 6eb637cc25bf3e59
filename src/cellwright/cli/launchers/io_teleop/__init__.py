"""Nodes of the io_teleop workspace, with the options of their scripts, in front of `cellwright teleop`."""
