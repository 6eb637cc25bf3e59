"""Exact statistics of columns and of pictures: range, mean, population deviation and quantiles over all frames."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.recording.dataset.layout import QUANTILES

_LEVELS = np.arange(256) / 255.0


def column_statistics(values: NDArray[Any]) -> dict[str, list[float]]:
    """Return each statistic of a column as a list: one figure for each of the n values of a row, and the count.

    Quantiles are those of `numpy.quantile`, with linear interpolation; a truth counts as 0 or 1.

    Args:
        values: (frames, n) or (frames,), at least one frame.
    """
    rows = values.reshape(len(values), -1).astype(np.float64)
    quantiles = np.quantile(rows, [*QUANTILES.values()], axis=0)
    found = {"min": rows.min(axis=0), "max": rows.max(axis=0), "mean": rows.mean(axis=0), "std": rows.std(axis=0)}
    found |= {"count": np.array([len(rows)]), **dict(zip(QUANTILES, quantiles, strict=True))}
    return {name: each.tolist() for name, each in found.items()}


class PictureStatistics:
    """Statistics of pictures by channel, from counts of their 256 levels: exact, whatever their number.

    Args:
        counts: pixels so far of each of the 256 levels, (3, 256); None for none.
        pictures: number of pictures so far.

    Attributes:
        counts: pixels of each level, (3, 256).
        pictures: number of pictures.

    Example:
        >>> seen = PictureStatistics()
        >>> seen.add(np.full((2, 2, 3), 51, np.uint8))
        >>> seen.as_lists()["mean"], seen.as_lists()["count"]
        ([[[0.2]], [[0.2]], [[0.2]]], [1])
    """

    def __init__(self, counts: NDArray[np.int64] | None = None, pictures: int = 0) -> None:
        self.counts = np.zeros((3, 256), np.int64) if counts is None else counts
        self.pictures = pictures

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture (height, width, 3)."""
        self.counts += [np.bincount(picture[..., channel].ravel(), minlength=256) for channel in range(3)]
        self.pictures += 1

    def include(self, other: "PictureStatistics") -> None:
        """Add all pictures of another value."""
        self.counts += other.counts
        self.pictures += other.pictures

    def as_lists(self) -> dict[str, list[Any]]:
        """Return each statistic in the shape (3, 1, 1), with levels from 0 to 1, and the number of pictures."""
        pixels = int(self.counts[0].sum())
        mean = self.counts @ _LEVELS / pixels
        deviations = (_LEVELS - mean[:, np.newaxis]) ** 2
        found = {
            "min": self._level(0),
            "max": self._level(pixels - 1),
            "mean": mean,
            "std": np.sqrt((deviations * self.counts).sum(axis=1) / pixels),
        }
        for name, share in QUANTILES.items():
            rank = int(share * (pixels - 1))
            below, above = self._level(rank), self._level(min(rank + 1, pixels - 1))
            found[name] = below + (above - below) * (share * (pixels - 1) - rank)
        shaped = {name: [[[float(value)]] for value in each] for name, each in found.items()}
        return {**shaped, "count": [self.pictures]}

    def _level(self, rank: int) -> NDArray[np.float64]:
        """Return the level of the pixel of this rank, from 0, in each channel."""
        ranks = self.counts.cumsum(axis=1)
        return np.array([_LEVELS[np.searchsorted(each, rank, side="right")] for each in ranks])
