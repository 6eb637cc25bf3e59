"""Topics and services inside the process: no wire, no thread, one order of delivery."""

from cellwright.middleware.bus.bus import Bus, Refusals, ServiceInfo, TopicInfo, absolute
from cellwright.middleware.bus.topics import Direction, Given, How, Later, Mailbox, Publisher, Subscription

__all__ = [
    "Bus",
    "Direction",
    "Given",
    "How",
    "Later",
    "Mailbox",
    "Publisher",
    "Refusals",
    "ServiceInfo",
    "Subscription",
    "TopicInfo",
    "absolute",
]
