"""The kit-building cell of 2017."""


def __getattr__(name: str) -> object:
    """Return `Cell`, which programs of version 0.1 imported from here."""
    if name != "Cell":
        raise AttributeError(f"module 'cellwright.cell' has no attribute {name!r}")
    from cellwright.cell.cell import Cell

    return Cell
