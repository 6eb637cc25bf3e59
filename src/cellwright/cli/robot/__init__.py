"""`cellwright robot`."""
