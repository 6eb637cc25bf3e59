"""Programs that work a cell or drive a robot, and what they hold in their hands."""
