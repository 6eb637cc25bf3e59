"""`cellwright replay`."""
