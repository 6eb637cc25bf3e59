"""Layout of the cell of the 2017 competition, from the packaged file."""

from functools import cache

from cellwright.config.layout.layout import Layout


@cache
def gear2017() -> Layout:
    """Return the layout of 2017: eight bins, a belt along y, an AGV at either end of the arm's rail.

    Example:
        >>> [each.name for each in gear2017().bins][:2]
        ['bin1', 'bin2']
    """
    # slow to load, and every program with a cell loads this module
    from cellwright.config.layout.basing import gear2017_section
    from cellwright.config.layout.reader import read_cell
    from cellwright.config.parsing.reader import Reader
    from cellwright.config.parsing.tree import Problems

    cell = read_cell(gear2017_section(), Reader(Problems()))
    assert cell is not None
    return cell.layout
