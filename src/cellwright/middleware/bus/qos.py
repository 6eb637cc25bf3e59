"""Quality of service of topics, in the terms of ROS 2."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Qos:
    """Quality of service of a topic.

    A publisher that `is_reliable` sends lost messages again. A reliable subscription gets nothing from a publisher that
    is not reliable.
    """

    is_reliable: bool = True
    is_transient_local: bool = False  # true if a late subscriber gets the newest messages
    depth: int = 10  # messages that are kept

    @property
    def text(self) -> str:
        """Return the quality of service in words: "reliable, depth 10", "best effort, depth 1000"."""
        words = ["reliable" if self.is_reliable else "best effort"]
        words += ["transient local"] * self.is_transient_local
        return ", ".join([*words, f"depth {self.depth}"])


RELIABLE = Qos()
LATCHED = Qos(is_transient_local=True, depth=1)
COMMANDS = Qos(depth=1000)
"""Quality of service of what the cell receives. Messages may each command a part of the joints, so none may replace an
earlier one that waits; the depth is more than a program publishes at once. Publishers of any depth match."""
BEST_EFFORT_COMMANDS = Qos(is_reliable=False, depth=COMMANDS.depth)
"""The same for topics with publishers of both kinds: a best-effort subscription receives from reliable ones, too."""
LARGE = Qos(depth=2)
"""Quality of service of pictures and point clouds: of such large messages, best effort loses most in ROS 2."""
