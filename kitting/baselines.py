"""Baselines: programs that say what a score is worth, each with the options of `cellwright eval` that name it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cellwright.util.errors import UnknownNameError
from kitting.benchmark import ROOT

RECORDED: Final = "kitter"
"""Baseline whose runs are recorded, for the one that replays them."""
REPLAY: Final = "replay"
CLONE: Final = "clone"
_BLIND = ("--policy-map", str(ROOT / "blind.yaml"))


@dataclass(frozen=True, slots=True)
class Baseline:
    """A baseline.

    Attributes:
        about: its behaviour, in a clause.
        sees: its observations.
        options: options of `cellwright eval`; `{scores}` stands for the folder of all scores.
    """

    about: str
    sees: str
    options: tuple[str, ...]

    def words(self, scores: Path) -> list[str]:
        """Return the options, with the folder of all scores in its place."""
        return [each.replace("{scores}", str(scores.resolve())) for each in self.options]


BASELINES: Final[Mapping[str, Baseline]] = {
    "random": Baseline("targets at random, in their ranges", "nothing", ("--policy", "random", *_BLIND)),
    "hold": Baseline("the arm stands still", "channels", ("--policy", "hold", *_BLIND)),
    RECORDED: Baseline("the bundled agent", "logical cameras, break beam, joints", ("--agent", "kitter")),
    REPLAY: Baseline(
        f"the recorded commands of `{RECORDED}`, sent again", "nothing", ("--agent", f"replay:{{scores}}/{RECORDED}")
    ),
    CLONE: Baseline(
        "behaviour cloning from the demonstrations, with a network of two layers",
        "joints, suction and the privileged state",
        ("--agent", "kitting.clone.agent:Clone"),
    ),
}
"""The baselines, in the order of tables."""


def find_baseline(name: str) -> Baseline:
    """Return a baseline by its name.

    Raises:
        UnknownNameError: there is none of this name.
    """
    if name not in BASELINES:
        raise UnknownNameError("baseline", name, BASELINES)
    return BASELINES[name]
