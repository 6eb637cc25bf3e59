"""The nodes of the io_teleop workspace, as their scripts are started: options in front of `cellwright teleop`."""
