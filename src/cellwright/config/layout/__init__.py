"""Layout of a cell: the places and sizes of everything that stands in it."""
