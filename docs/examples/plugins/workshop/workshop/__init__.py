"""What a package can bring along for Cellwright."""

from pathlib import Path

COUNTING = Path(__file__).parent / "counting.yaml"
"""A trial is the path of its file."""
