"""Shared catkin workspace of tests: the result of the lesson's first command in an empty home folder."""

from dataclasses import dataclass
from pathlib import Path

from tests.support.waiting import TIMEOUT

BUILD = 3 * TIMEOUT
"""Bound of a build with catkin [s]."""


@dataclass(frozen=True)
class FirstStep:
    """Result of the lesson's first command, `cellwright ros1-workspace ~/simulation_ws`.

    Attributes:
        home: the home folder, which was empty before.
        printed: output of the command.
    """

    home: Path
    printed: str

    @property
    def workspace(self) -> Path:
        return self.home / "simulation_ws"
