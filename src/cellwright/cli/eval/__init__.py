"""`cellwright eval`."""
