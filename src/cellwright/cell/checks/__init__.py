"""Checks of a cell before it runs: reach of the arm, views of cameras, things that are in each other's way."""
