"""Pictures as policies were trained on them: fitted into a size with black borders, by the rule of OpenPI's client."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def fitted(picture: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a picture, shape (H, W, 3), scaled to fit into a size, in the middle of black borders.

    The rule is that of OpenPI's own client, pixel by pixel: the larger ratio of the sides counts, new
    sides are rounded down, and Pillow's bilinear filter scales. A picture of this size stays as it is.

    Args:
        picture: (H, W, 3), uint8.
        size: width and height [px].

    Example:
        >>> wide = np.full((2, 4, 3), 200, np.uint8)
        >>> fitted(wide, (4, 4))[:, 0, 0].tolist()
        [0, 200, 200, 0]
    """
    width, height = size
    rows, columns = picture.shape[:2]
    if (columns, rows) == size:
        return picture
    ratio = max(columns / width, rows / height)
    inner = max(1, int(columns / ratio)), max(1, int(rows / ratio))
    scaled = np.asarray(Image.fromarray(picture).resize(inner, resample=Image.Resampling.BILINEAR))
    found = np.zeros((height, width, 3), np.uint8)
    left, top = max(0, int((width - inner[0]) / 2)), max(0, int((height - inner[1]) / 2))
    found[top : top + inner[1], left : left + inner[0]] = scaled
    return found
