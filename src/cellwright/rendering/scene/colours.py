"""Colours: which one a geom of the engine's has, and how much light it stands for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import mujoco

_UNSET = (0.5, 0.5, 0.5, 1.0)
"""The engine's default colour of a geom; a geom with a material that has this colour shows the material's."""


def geom_colours(model: mujoco.MjModel) -> NDArray[np.float64]:
    """The colour and opacity (ngeom, 4) of every geom, sRGB 0..1: its own, or else its material's."""
    colours = np.array(model.geom_rgba, np.float64)
    from_material = (model.geom_matid >= 0) & np.all(model.geom_rgba == np.array(_UNSET, np.float32), axis=1)
    colours[from_material] = model.mat_rgba[model.geom_matid[from_material]]
    return colours


def linear(colour: NDArray[np.floating]) -> NDArray[np.float32]:
    """Amounts of light for sRGB values 0..1 (IEC 61966-2-1)."""
    c = np.asarray(colour, np.float32)
    return np.where(c <= 0.04045, c / 12.92, ((np.maximum(c, 0.04045) + 0.055) / 1.055) ** 2.4).astype(np.float32)
