"""`cellwright serve`."""
