"""Places of 2017's cell as the kitter has them."""

from cellwright.clients.agents.kitter.clearance import Clearance
from cellwright.clients.agents.kitter.ur10_on_rail import Ur10OnRail
from cellwright.clients.agents.kitter.workplace import Workplace
from cellwright.clients.client.client import Client
from cellwright.config.layout.layout import Layout
from tests.support.places import LAYOUT

ARM = Ur10OnRail(LAYOUT.arms[0])
WORKPLACE = Workplace(LAYOUT, ARM)
STATIONS = WORKPLACE.stations
BINS = WORKPLACE.bin_areas
(BELT,) = WORKPLACE.belts
BELT_MIDDLE, BELT_SURFACE, BELT_SPEED = BELT.point(0.0)[0], BELT.belt.surface, BELT.belt.speed
HALF = STATIONS[1].half
TRAY_SURFACE = STATIONS[1].surface


def workplace(layout: Layout) -> Workplace:
    """Return the places of a cell with the UR10 on its rail."""
    return Workplace(layout, Ur10OnRail(layout.arms[0]))


def clearance_of(client: Client) -> Clearance:
    """Return the clearance of that arm in a cell that stands as that of 2017."""
    return Clearance(client.solids(), client.chains()["arm"], ARM)
