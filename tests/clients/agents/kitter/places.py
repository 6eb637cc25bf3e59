"""Places of 2017's cell as the kitter has them."""

from cellwright.clients.agents.kitter.workplace import Workplace
from tests.support.places import LAYOUT

WORKPLACE = Workplace(LAYOUT)
STATIONS = WORKPLACE.stations
BINS = WORKPLACE.bin_areas
(BELT,) = WORKPLACE.belts
BELT_MIDDLE, BELT_SURFACE, BELT_SPEED = BELT.point(0.0)[0], BELT.belt.surface, BELT.belt.speed
HALF = STATIONS[1].half
TRAY_SURFACE = STATIONS[1].surface
