"""Program of LeRobot's environment: opens a data set, and writes all of its items.

`python lerobot_items.py FOLDER OUT.npz`: numbers of each feature, the sentences, and of each picture the mean levels of
its blocks of 8 x 8 pixels, 0 to 255.
"""

import sys
from typing import Any

import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset

BLOCK = 8


def main(folder: str, out: str) -> None:
    """Read all items one by one."""
    data = LeRobotDataset("cellwright/judged", root=folder, video_backend="pyav")
    found: dict[str, list[Any]] = {}
    for number in range(len(data)):
        for key, value in data[number].items():
            if not hasattr(value, "numpy"):
                found.setdefault(key, []).append(value)
                continue
            array = value.numpy()
            found.setdefault(key, []).append(_blocks(array) if array.ndim == 3 else array)
    arrays: dict[str, Any] = {key: np.array(values) for key, values in found.items()}
    np.savez(out, **arrays)


def _blocks(picture: Any) -> Any:
    """Return the mean levels of a picture (3, height, width) with levels 0..1, by blocks: (height, width, 3)."""
    _, height, width = picture.shape
    rows, columns = height // BLOCK, width // BLOCK
    cut = picture[:, : rows * BLOCK, : columns * BLOCK].reshape(3, rows, BLOCK, columns, BLOCK)
    return (cut.mean(axis=(2, 4)) * 255.0).transpose(1, 2, 0)


if __name__ == "__main__":
    main(*sys.argv[1:3])
