"""Noise of pictures: a function of seed, camera and sample number, and quick for a million pixels.

A normal number for each pixel would take longer than all else that the cell's process does for a picture. So random
bytes choose from a table of the normal distribution's quantiles, which is exact to the eye and to a standard
deviation.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from cellwright.config.trial.trial import PictureNoise
from cellwright.engine.chance import SampleNoise

_COLOUR, _DEPTH = 1, 2  # streams of random bytes
_WHITE = 255
_LEVELS = 256


def blur_colour(
    colour: NDArray[np.uint8], noise: PictureNoise, chance: SampleNoise, sample: int, factor: float = 1.0
) -> NDArray[np.uint8]:
    """A picture with noise; the sample's number says which.

    Args:
        colour: the picture, of any shape.
        noise: how strong.
        chance: where it comes from.
        sample: number of the sample.
        factor: on the standard deviation.
    """
    deviation = noise.colour * factor * _WHITE
    if deviation == 0.0:
        return colour
    shifts = np.rint(_quantiles() * deviation).astype(np.int16)
    random = chance.bytes(sample, colour.size, _COLOUR).reshape(colour.shape)
    blurred: NDArray[np.uint8] = np.clip(colour + shifts[random], 0, _WHITE).astype(np.uint8)
    return blurred


def blur_depth(
    depth: NDArray[np.float32], noise: PictureNoise, chance: SampleNoise, sample: int, factor: float = 1.0
) -> NDArray[np.float32]:
    """Depths [m] with noise, as in `blur_colour`; what is not finite stays as it is."""
    if factor == 0.0 or noise.depth == noise.depth_growth == 0.0:
        return depth
    random = chance.bytes(sample, depth.size, _DEPTH).reshape(depth.shape)
    deviation = np.float32(factor * noise.depth) + np.float32(factor * noise.depth_growth) * depth * depth
    blurred: NDArray[np.float32] = depth + deviation * _quantiles()[random]
    return blurred


@cache
def _quantiles() -> NDArray[np.float32]:
    """Numbers as likely as one another that are distributed normally, with a standard deviation of 1."""
    from statistics import NormalDist

    normal = NormalDist()
    found = np.array([normal.inv_cdf((level + 0.5) / _LEVELS) for level in range(_LEVELS)])
    scaled: NDArray[np.float64] = found / found.std()
    return scaled.astype(np.float32)
