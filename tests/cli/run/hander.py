"""A scripted policy of the task `hand_over`, which knows where the gear lies: the map and the program of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cellwright import load_robot

MAP, PROGRAM = "map.yaml", "hander.py"
NEAR, PATIENCE = 0.01, 40
"""Distance [m] at which a hand is where it should be, and the most periods that are waited for it."""

RIGHT, LEFT = (0.42, -0.24, 1.2), (0.35, 0.2, 1.25)
STAGES = (
    # right hand and left hand [m], how far they are closed, and periods to stay
    (RIGHT, LEFT, (0.0, 0.0), 0),
    ((0.42, -0.24, 1.06), LEFT, (0.0, 0.0), 0),
    ((0.42, -0.24, 1.06), LEFT, (1.0, 0.0), 10),
    ((0.42, -0.12, 1.25), LEFT, (1.0, 0.0), 0),
    ((0.42, -0.03, 1.25), (0.42, 0.03, 1.25), (1.0, 0.0), 0),
    ((0.42, -0.03, 1.25), (0.42, 0.03, 1.25), (0.0, 1.0), 1000),
)


class Hander:
    """Takes the gear with the right hand, holds it before the chest, and lets go as the left hand closes."""

    def __init__(self) -> None:
        self._stage = self._periods = 0
        grippers = load_robot("qinglong").grippers
        model = load_robot("qinglong").robot
        self._ranges = [
            np.array([each.open_and_closed(model.joint(name)) for name in each.joints], float) for each in grippers
        ]

    def infer(self, observation: Any) -> dict[str, Any]:
        """Answer with one action: the points of both hands, then the joints of both."""
        right, left, closed, stay = STAGES[self._stage]
        points = np.array([*right, *left])
        is_there = np.abs(np.asarray(observation["tips"]) - points).max() < NEAR
        self._periods += 1
        if self._periods > stay and (is_there or self._periods > PATIENCE) and self._stage + 1 < len(STAGES):
            self._stage, self._periods = self._stage + 1, 0
        fingers = [
            ends[:, 0] + share * (ends[:, 1] - ends[:, 0]) for ends, share in zip(self._ranges, closed, strict=True)
        ]
        return {"actions": [np.concatenate([points, *fingers]).tolist()]}


def write_files(folder: Path) -> None:
    """Write the map, and a program of the policy."""
    robot = load_robot("qinglong")
    fingers = [", ".join(f"qinglong/{name}" for name in each.joints) for each in robot.grippers]
    hands = [f"{{pose: qinglong/{side}, rotation: none, frame: world}}" for side in ("right", "left")]
    actions = [*hands, *(f"{{channels: [{each}]}}" for each in fingers)]
    (folder / MAP).write_text(
        f"rate: 20\nobservation: {{tips: [{', '.join(hands)}]}}\nactions: [{', '.join(actions)}]\n"
    )
    (folder / PROGRAM).write_text("from tests.cli.run.hander import Hander\n")
