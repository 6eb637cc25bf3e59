"""Topics and services inside the process: no wire, no thread, one order of delivery."""

from cellwright.bus.bus import Bus, ServiceInfo, TopicInfo, absolute
from cellwright.bus.given import Given, How
from cellwright.bus.later import Later
from cellwright.bus.mailbox import Mailbox
from cellwright.bus.refusals import Refusals
from cellwright.bus.topics import Direction, Publisher, Subscription

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
