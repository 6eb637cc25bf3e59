"""Shapes, meshes and colours of the engine's model."""
