"""Topics and services inside the process: no wire, no thread, one order of delivery."""

from cellwright.middleware.bus.bus import Bus, ServiceInfo, TopicInfo, absolute
from cellwright.middleware.bus.given import Given, How
from cellwright.middleware.bus.later import Later
from cellwright.middleware.bus.mailbox import Mailbox
from cellwright.middleware.bus.refusals import Refusals
from cellwright.middleware.bus.topics import Direction, Publisher, Subscription

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
