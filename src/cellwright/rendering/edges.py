"""Where a picture needs more than one ray per pixel, and where in the pixel those rays go."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.layers import Layer

_COSINE = 0.95  # between the normals of neighbouring pixels
_COLOUR = 0.02  # between their colours, linear


def edge_pixels(layer: Layer) -> NDArray[np.int64]:
    """The pixels (k,) that differ from one of their four neighbours in geom, in colour or in the way they face."""
    shape = (layer.height, layer.width)
    geom = layer.hits.geom.reshape(shape)
    normal = layer.hits.normal.astype(np.float32).reshape(*shape, 3)
    albedo = layer.albedo.reshape(*shape, 3)
    edge = np.zeros(shape, np.bool_)
    for here, there in (
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
    ):
        turned = np.einsum("ijk,ijk->ij", normal[here], normal[there]) < _COSINE
        differs = (geom[here] != geom[there]) | (turned & (geom[here] >= 0))
        differs |= np.abs(albedo[here] - albedo[there]).max(axis=2) > _COLOUR
        edge[here] |= differs
        edge[there] |= differs
    return np.flatnonzero(edge)


def pixel_points(pixels: NDArray[np.int64], width: int, *, samples: int) -> NDArray[np.float64]:
    """Column and row of samples * samples points in each of the `pixels` (n,): (n * samples * samples, 2).

    They lie in the middles of equal squares, each row of squares shifted a little against the next, so that nearly
    level and nearly upright edges come out smooth as well; with one sample it is the middle of the pixel.
    """
    step = np.arange(samples)
    down, right = (a.reshape(-1) for a in np.meshgrid(step, step, indexing="ij"))
    shift = (step - (samples - 1) / 2) / samples
    across = (right + 0.5 + shift[down]) / samples
    along = (down + 0.5 + shift[right]) / samples
    rows, columns = np.divmod(pixels, width)
    points = np.empty((len(pixels), samples * samples, 2))
    points[:, :, 0] = columns[:, None] + across
    points[:, :, 1] = rows[:, None] + along
    return points.reshape(-1, 2)
