"""Judges of data sets: programs of others, each in an environment of its own, and what they find."""
