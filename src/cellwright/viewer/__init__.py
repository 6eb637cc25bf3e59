"""Pictures of a cell."""
