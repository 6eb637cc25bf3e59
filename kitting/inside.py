"""The cell in the process of an agent, for programs that use what no sensor tells."""

from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.util.errors import UsageError


def cell_of(client: Client) -> Cell:
    """Return the cell of a client in its process.

    Raises:
        UsageError: the cell is in another process.
    """
    transport = client.transport
    if not isinstance(transport, InProcess) or not isinstance(transport.cell, Cell):
        raise UsageError("agent: it uses what no sensor tells, so it needs the cell in its process; leave out --over")
    return transport.cell
