"""Topics and services inside the process: no wire, no thread, one order of delivery."""

from cellwright.middleware.bus.bus import Bus, Refusals, Served, ServiceInfo, TopicInfo, absolute
from cellwright.middleware.bus.topics import Direction, Given, How, Later, Publisher, Subscription

__all__ = [
    "Bus",
    "Direction",
    "Given",
    "How",
    "Later",
    "Publisher",
    "Refusals",
    "Served",
    "ServiceInfo",
    "Subscription",
    "TopicInfo",
    "absolute",
]
