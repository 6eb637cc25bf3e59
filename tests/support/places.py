"""Places of the cell of 2017, taken from its layout."""

from cellwright.config.layout.gear2017 import gear2017

LAYOUT = gear2017()
BELT = LAYOUT.belts[0]
BELT_SURFACE = BELT.surface
BELT_SPEED = BELT.speed
SPAWN_FRAME = BELT.spawn
BIN_CENTRES = {each.name: each.centre for each in LAYOUT.bins}
BIN_SURFACE = LAYOUT.bins[0].surface
BIN_PART_HEIGHT = LAYOUT.bins[0].grid_height
AGVS = {each.number: each for each in LAYOUT.carriers}
TRAY_IDS = {each.name: each.tray_link for each in LAYOUT.carriers}
TRAY_SURFACE = AGVS[1].surface
TRAY_PLATE = AGVS[1].plate
AGV_T_TRAY = AGVS[1].home_T_tray
