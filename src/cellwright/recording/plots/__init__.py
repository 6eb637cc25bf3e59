"""Figures of what was recorded: what moved, what lay where, and what it was worth, over time."""
