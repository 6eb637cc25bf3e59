"""Colours of the cell: red, green, blue, opacity in 0..1."""

from cellwright.engine.shapes import Colour


def _hex(code: int) -> Colour:
    """Return a colour from 0xRRGGBB."""
    return ((code >> 16) / 255, (code >> 8 & 255) / 255, (code & 255) / 255, 1.0)


FLOOR = _hex(0xB9BDC1)
LINE_YELLOW = _hex(0xE8B93B)
STEEL = _hex(0x9AA3AB)
STEEL_LIGHT = _hex(0xC3CAD0)
STEEL_DARK = _hex(0x5C656D)
ALUMINIUM = _hex(0xD5D9DC)
BLACK = _hex(0x1E2124)
RUBBER = _hex(0x2B2E31)
WHITE = _hex(0xF2F2F0)

BELT = _hex(0x2F3336)
BELT_EDGE = _hex(0x4C7A3F)
BIN = _hex(0x7E95A8)
BIN_FLOOR = _hex(0x9DB0BF)
FRAME = _hex(0xA7AFB5)

AGV1 = _hex(0xE0762B)
AGV2 = _hex(0x2F6FB4)
TRAY = _hex(0xD9DDD6)

ARM_GREY = _hex(0xBFC5CB)
ARM_JOINT = _hex(0x4A86B8)
RAIL = _hex(0x53585E)
CUP = _hex(0x22252A)

GEAR = _hex(0xC79A3B)
PISTON = _hex(0xB5462F)
PISTON_HEAD = _hex(0xC8CED4)
GASKET = _hex(0x3E6F4A)
DISK = _hex(0x3E63A8)
PULLEY = _hex(0x7A4A8C)
PULLEY_FLANGE = _hex(0x9A6CAB)
PART1 = _hex(0xD9A441)
PART2 = _hex(0x5BB5A2)
PART3 = _hex(0xC75C7A)
PART4 = _hex(0x6C7FD0)
MARK = _hex(0x17181A)
MARK_LIGHT = _hex(0xF4E04D)

SENSOR = _hex(0x30363C)
SENSOR_LENS = _hex(0x1B87C9)
SENSOR_BEAM = _hex(0xD8342C)
