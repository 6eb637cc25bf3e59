"""Figures of recordings: motions, trays, score and commands over time."""
