"""What can be asked for; apart from what draws it, which takes a moment to load."""

SUFFIXES = (".png", ".svg", ".pdf")
"""Of the files that can be written."""

WHAT = ("score", "trays", "joints", "tool", "commands")
"""Parts of a figure, in the order in which they stand on the page."""
