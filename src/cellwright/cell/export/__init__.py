"""A cell for other programs: its description with all that stands in it, MoveIt's package, and the engine's model."""
