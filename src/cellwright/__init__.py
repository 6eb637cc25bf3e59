"""Cellwright: industrial robot cells, simulated in Python."""

__version__ = "0.1.0"
