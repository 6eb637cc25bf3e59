"""Programs that work a cell or drive a robot, and their client library."""
