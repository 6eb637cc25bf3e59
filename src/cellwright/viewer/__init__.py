"""Viewers: clients of a server that show a run, each in its own process."""
