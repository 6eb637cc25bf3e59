"""Bus of a cell or robot: topics and services inside the process."""

from cellwright.middleware.bus.bus import Bus, ExternalInput, InputKind, Node, PendingResponse, Service
from cellwright.middleware.bus.qos import BEST_EFFORT_COMMANDS, COMMANDS, LARGE, LATCHED, RELIABLE, Qos
from cellwright.middleware.bus.refusals import Refusals
from cellwright.middleware.bus.topic import Direction, Publisher, Subscription, TopicInfo, absolute

__all__ = [
    "BEST_EFFORT_COMMANDS",
    "COMMANDS",
    "LARGE",
    "LATCHED",
    "RELIABLE",
    "Bus",
    "Direction",
    "ExternalInput",
    "InputKind",
    "Node",
    "PendingResponse",
    "Publisher",
    "Qos",
    "Refusals",
    "Service",
    "Subscription",
    "TopicInfo",
    "absolute",
]
