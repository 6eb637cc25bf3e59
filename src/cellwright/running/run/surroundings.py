"""Surroundings of the arms for an operator agent, from the cell in the same process."""

from collections.abc import Mapping, Sequence

from cellwright.cell.cell import Cell
from cellwright.clients.agents.operator.aids import SeenPart
from cellwright.util.pose import Pose, Vector3


class CellSurroundings:
    """Parts and belts of a cell, now; asking changes nothing. See `Surroundings`.

    Args:
        cell: the cell.

    Example:
        >>> from cellwright import Cell, load_trial
        >>> seen = CellSurroundings(Cell(load_trial("lesson")))
        >>> len(seen.parts()) > 10, len(seen.belts())
        (True, 1)
    """

    def __init__(self, cell: Cell) -> None:
        self._cell = cell

    def parts(self) -> Sequence[SeenPart]:
        """Return all parts in the cell."""
        cell, simulation = self._cell, self._cell.simulation
        simulation.refresh()
        data, found = simulation.data, []
        for part in cell.parts.all:
            if part.name not in cell.parts.in_play:
                continue
            px, py, pz = data.xpos[part.body].tolist()
            w, x, y, z = data.xquat[part.body].tolist()
            vx, vy, vz = data.qvel[part.dof : part.dof + 3].tolist()
            found.append(SeenPart(part.name, part.type, Pose((px, py, pz), (w, x, y, z)), (vx, vy, vz)))
        return found

    def belts(self) -> Mapping[str, Vector3]:
        """Return the present velocity of each belt's surface in the world [m/s], by the belt's name."""
        return {name: each.velocity for name, each in self._cell.conveyors.items()}
