"""What a client can find in ROS: topics and services with their types, in the form of a cell's WELCOME."""

from __future__ import annotations

from typing import Any

from cellwright.middleware.ros1.bridge.master import Master
from cellwright.middleware.ros1.bridge.service_client import ServiceClient, ServiceGoneError
from cellwright.middleware.ros1.bridge.step_service import NAME as STEP
from cellwright.middleware.wire.frames import PROTOCOL

CLOCK = "/clock"
_LOGGERS = ("/get_loggers", "/set_logger_level")


def census(master: Master, node: str, sign: str = CLOCK) -> dict[str, Any] | None:
    """WELCOME for what is there, without the time; None while there is no simulator, or one still comes up.

    Args:
        master: the ROS master.
        node: our node name.
        sign: the topic that is published where there is one.

    Raises:
        MasterGoneError: the master does not answer.
    """
    state, types = master.ask("getSystemState"), dict(master.ask("getTopicTypes") or ())
    if state is None:
        return None
    publishers, subscribers, servers = (dict(role) for role in state)
    if sign not in publishers:
        return None
    topics = [
        {
            "name": name,
            "type": types.get(name, ""),
            "md5": "",
            "definition": "",
            "direction": "out" if name in publishers else "in",
            "rate": "",
            "on_event": False,
            "latch": False,
            "publishers": publishers.get(name, []),
            "subscribers": subscribers.get(name, []),
        }
        for name in sorted({*publishers, *subscribers})
    ]
    services = []
    for name in sorted(servers):
        if name.endswith(_LOGGERS):
            continue
        try:
            type_name, md5 = ServiceClient(master, node, name).ask_type()
        except ServiceGoneError:  # left behind by a node that is gone
            continue
        services.append({"name": name, "type": type_name, "md5": md5, "node": servers[name][0]})
    return {
        "protocol": PROTOCOL,
        "cellwright": "",
        "trial": "",
        "timestep": [0, 1],
        "lockstep": any(service["name"] == STEP for service in services),
        "competition": None,
        "topics": topics,
        "services": services,
    }
