"""The engine's model of a robot: links, contacts, the floor under it."""
