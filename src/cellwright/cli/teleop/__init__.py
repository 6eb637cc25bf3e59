"""`cellwright teleop`."""
