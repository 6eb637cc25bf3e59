"""State that the engine keeps in its data and in fields of its model, and its warnings."""

from __future__ import annotations

import hashlib
import logging
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.engine.installed import check_loaded

# nothing runs without this module, whichever loaded the engine
check_loaded(mujoco)

CHANGING_FIELDS = ("eq_data", "geom_surfacevel")
"""Fields of the model that devices write at run time. They are state, though the engine keeps them in the model."""
CULLING_FIELDS = ("body_contype", "body_conaffinity", "body_gravcomp")
"""Fields of the model that a device writes that has them in its own state."""
ASLEEP_AFTER = -11
"""Value of `MjData.tree_asleep` for a tree that has just been woken: it counts up to sleep from there."""
_AWAKE_COUNTS = ("ntree_awake", "nbody_awake", "nparent_awake", "nv_awake")
"""Lengths of the engine's lists of what is awake."""

_log = logging.getLogger("cellwright.engine")
unstable: list[str] = []
"""The engine's warnings about a state with NaN or huge numbers; the rest of such a run is worthless."""


def copy_fields(before: mujoco.MjModel, after: mujoco.MjModel) -> None:
    """Copy the changing fields of a model into one with more bodies behind those of the first."""
    for name in CHANGING_FIELDS:
        _copy_rows(getattr(before, name), getattr(after, name))


def copy_data(before: mujoco.MjData, model: mujoco.MjModel, after: mujoco.MjData) -> None:
    """Copy a state into the new data of a model with more bodies, all of which are asleep.

    The engine can save and load a state between models of one size only, and wakes everything with it. So each array
    is copied as it is, the lists of what is awake included.
    """
    mujoco.mj_kinematics(model, after)
    mujoco.mj_comPos(model, after)
    after.time = before.time
    for name in _AWAKE_COUNTS:
        setattr(after, name, getattr(before, name))
    # each new tree is a sleeping island of its own: its entry is the next tree of its island, itself
    after.tree_asleep[:] = range(model.ntree)
    after.tree_awake[:] = 0
    after.body_awake[:] = 0
    for name in dir(after):
        if isinstance(values := getattr(before, name), np.ndarray):
            _copy_rows(values, getattr(after, name))


def hash_engine(model: mujoco.MjModel, data: mujoco.MjData) -> hashlib._Hash:
    """Return a SHA-256 over the engine's state, to which the caller may add."""
    digest = hashlib.sha256()
    fields = (getattr(model, name) for name in CHANGING_FIELDS)
    for array in (data.qpos, data.qvel, data.act, data.ctrl, data.eq_active, *fields):
        # 0.0 and -0.0 are the same state: waking replaces one by the other
        digest.update((np.ascontiguousarray(array) + 0).tobytes())
    return digest


def _copy_rows(source: NDArray[Any], target: NDArray[Any]) -> None:
    """Copy all rows of an array into the first ones of an array that is no shorter."""
    if len(source) <= len(target):
        target[: len(source)] = source


def _take_warning(text: str) -> None:
    _log.warning(text)
    if "unstable" in text:
        unstable.append(text)


mujoco.set_mju_user_warning(_take_warning)
