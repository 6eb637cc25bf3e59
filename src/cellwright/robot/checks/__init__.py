"""Checks of how a robot moves and of what a driver promises."""
