"""A module to build programs on that work the kit-building cell."""
