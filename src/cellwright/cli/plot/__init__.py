"""`cellwright plot`."""
