"""The engine's sleepers: trees of bodies that have come to rest, and what wakes them, which touches no state."""

from __future__ import annotations

import mujoco
import numpy as np

ASLEEP_AFTER = -11
"""Value of `MjData.tree_asleep` for a tree that has just been woken: it counts up to sleep from there."""


def wake(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> None:
    """Wake the tree of a body.

    A changed surface velocity or a moved support does not wake sleepers; a velocity written as -0.0 does, because
    the engine compares bytes.
    """
    tree = int(model.body_treeid[body])
    if tree >= 0:
        first = int(model.tree_dofadr[tree])
        dofs = slice(first, first + int(model.tree_dofnum[tree]))
        velocity = data.qvel[dofs]
        data.qvel[dofs] = np.where(velocity == 0.0, -0.0, velocity)


def keep_awake(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> None:
    """Wake the tree of a body, or where it is awake start its count to sleep anew."""
    tree = int(model.body_treeid[body])
    if tree >= 0 and data.tree_asleep[tree] < 0:
        data.tree_asleep[tree] = ASLEEP_AFTER
    else:
        wake(model, data, body)
