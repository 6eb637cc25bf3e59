"""Results of some steps of a vector of environments, for comparisons."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv

ID = "cellwright.envs:PickFromBin-v0"
COUNT = 2
STEPS = 5


def story(envs: VectorEnv[Any, Any, Any], steps: int = STEPS) -> list[Any]:
    """Return all that a reset and some steps tell, and close the vector."""
    with closing(envs):
        first = envs.reset(seed=5)
        generator, base = np.random.default_rng(0), first[0]["agent_pos"].copy()
        moved = (base + generator.uniform(-0.1, 0.1, base.shape).astype(np.float32) for _ in range(steps))
        return [first, *(envs.step(action) for action in moved)]
