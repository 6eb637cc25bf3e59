"""Plugins of one package: a trial, an agent, a sensor and a device."""

from pathlib import Path

COUNTING = Path(__file__).parent / "counting.yaml"
"""A trial is the path of its file."""
