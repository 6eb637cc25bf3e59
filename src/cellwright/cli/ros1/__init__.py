"""`cellwright ros1-env` and `cellwright ros1-workspace`."""
