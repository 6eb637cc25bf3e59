"""A band of rows of a picture, drawn by itself.

Bands keep the arrays small, whatever the size of the picture, and let several threads draw at once. Pixels share light
with their neighbours, so a band is computed with a margin of rows above and below it, which are then dropped: the
picture does not show where bands meet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.camera import Camera
from cellwright.rendering.edges import edge_pixels, pixel_points
from cellwright.rendering.layers import hits_behind, light_layer, light_seen, spread
from cellwright.rendering.shading import Shader

BAND_HEIGHT = 90  # rows; two bands in a small picture of 320 x 180, twelve in one of 1920 x 1080
_MARGIN = 5  # rows; light is shared over three, borrowed over one, and edges are looked for over one
_PIXELS_AT_ONCE = 16384  # of those that take more than one ray


def bands(height: int) -> list[range]:
    """The rows of a picture in bands, from above."""
    return [range(first, min(first + BAND_HEIGHT, height)) for first in range(0, height, BAND_HEIGHT)]


def draw_band(
    shader: Shader, camera: Camera, width: int, height: int, rows: range, samples: int
) -> NDArray[np.float32]:
    """The light (len(rows), width, 3), linear, of some rows of a `width` x `height` picture.

    `samples` is the number of rays along each side of a pixel in which surfaces meet.
    """
    wide = range(max(0, rows.start - _MARGIN), min(height, rows.stop + _MARGIN))
    start = wide.start * width  # what is called a pixel below is counted from here
    everywhere = np.arange(len(wide) * width)
    directions = camera.directions(pixel_points(start + everywhere, width, samples=1), width, height)
    hits = shader.caster.cast(shader.eye, directions)
    layers = [light_layer(shader, hits, directions, wide, width)]
    behind, hits_through = hits_behind(shader, hits, directions)
    if len(behind):
        layers.append(light_layer(shader, spread(hits_through, behind, len(directions)), directions, wide, width))

    kept = slice((rows.start - wide.start) * width, (rows.stop - wide.start) * width)
    light = light_seen(shader, layers, everywhere[kept], hits[kept], directions[kept])
    edges = edge_pixels(layers[0]) if samples > 1 else everywhere[:0]
    edges = edges[(edges >= kept.start) & (edges < kept.stop)]
    for first in range(0, len(edges), _PIXELS_AT_ONCE):
        pixels = edges[first : first + _PIXELS_AT_ONCE]
        directions = camera.directions(pixel_points(start + pixels, width, samples=samples), width, height)
        hits = shader.caster.cast(shader.eye, directions)
        seen = light_seen(shader, layers, np.repeat(pixels, samples * samples), hits, directions)
        light[pixels - kept.start] = seen.reshape(len(pixels), samples * samples, 3).mean(axis=1)
    return light.reshape(len(rows), width, 3)
