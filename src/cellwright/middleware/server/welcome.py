"""What a guest is told first: the cell, its topics and its services."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import cellwright
from cellwright.middleware.bus import Bus, TopicInfo
from cellwright.middleware.bus.served import Served
from cellwright.middleware.interface.table import Pace
from cellwright.middleware.messages import definition, md5
from cellwright.middleware.wire.frames import PROTOCOL, Frame, Kind
from cellwright.util.errors import UsageError


def welcome(cell: Served, *, lockstep: bool) -> Frame:
    """The frame that answers HELLO, as things stand now."""
    timestep = cell.simulation.clock.timestep
    document = {
        "protocol": PROTOCOL,
        "cellwright": cellwright.__version__,
        "trial": cell.name,
        "timestep": [timestep.numerator, timestep.denominator],
        "lockstep": lockstep,
        "competition": cell.in_competition,
        "time": cell.simulation.now,
        **names(cell.bus),
    }
    return Frame(Kind.WELCOME, payload=json.dumps(document).encode())


def names(bus: Bus) -> dict[str, list[dict[str, Any]]]:
    """Topics and services with their types; the first call takes some time, for checksums are worked out."""
    services = [
        {"name": service.name, "type": service.type, "md5": checksum(service.type), "node": service.node}
        for service in bus.services()
    ]
    return {"topics": [_topic(info) for info in bus.topics()], "services": services}


def _topic(info: TopicInfo) -> dict[str, Any]:
    return {
        "name": info.name,
        "type": info.type,
        "md5": checksum(info.type),
        "definition": _definition(info.type),
        "direction": info.direction.value,
        "rate": info.rate,
        "on_event": info.rate == Pace.ON_EVENT.value,
        "latch": info.latch,
        "publishers": list(info.publishers),
        "subscribers": list(info.subscribers),
    }


@cache
def checksum(type_name: str) -> str:
    """The ROS 1 checksum of a type; empty for one that has no form in ROS 1."""
    try:
        return md5(type_name)
    except UsageError:
        return ""


@cache
def _definition(type_name: str) -> str:
    try:
        return definition(type_name)
    except UsageError:
        return ""
