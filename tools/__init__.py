"""Generators of parts of the docs and of the bundled robots; not in the wheel."""
