"""Losses on a topic of ROS 2, found by the numbers of its messages.

Fast DDS reports no message that a newer one replaced in a full queue.
"""

from __future__ import annotations

from collections.abc import Callable


class PublisherNumbers:
    """Numbers of a topic's messages, by which losses are found: each publisher counts its own from 1.

    A message does not tell its publisher. A number that continues no known one is that of a publisher that joined, if
    there are more publishers than known ones; else messages were lost. `count_publishers` returns their number.
    """

    def __init__(self, count_publishers: Callable[[], int]) -> None:
        self._count_publishers = count_publishers
        self._newest: list[int] = []  # number of the newest message of each known publisher; the latest one last

    def note(self, number: int) -> int:
        """Note a message's number; return how many messages were lost before it."""
        newest = self._newest
        if number - 1 in newest:
            newest.remove(number - 1)
            newest.append(number)
            return 0
        count = max(1, self._count_publishers())
        lower = [each for each in newest if each < number]
        if number > 1 and lower and len(newest) >= count:
            last = max(lower)
            newest.remove(last)
            newest.append(number)
            return number - last - 1
        newest.append(number)
        del newest[:-count]  # of publishers that are gone
        return 0
