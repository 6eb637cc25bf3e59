"""Checks of robot motion and of drivers."""
