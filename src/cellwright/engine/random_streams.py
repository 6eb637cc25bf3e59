"""Random streams by name: every device draws from a child of the one root seed, named after the device.

There are two kinds. A device whose draws affect the run uses `generator(seed, name)`, and its position in the stream is
part of the snapshot. Sensor noise is counter-based: sample n of a device always has the same numbers, independent of
listeners, so that watching changes nothing.
"""

from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

_MASK = (1 << 64) - 1


def key(seed: int, name: str) -> NDArray[np.uint64]:
    """Return the Philox key, shape (2,), of a named child of the root seed."""
    digest = blake2b(f"{seed}/{name}".encode(), digest_size=16).digest()
    return np.frombuffer(digest, dtype=np.uint64).copy()


def generator(seed: int, name: str) -> np.random.Generator:
    """Return a generator for sequential draws, from the named child of the root seed."""
    return np.random.Generator(np.random.Philox(key=key(seed, name)))


class SampleNoise:
    """Noise of one device by sample number."""

    def __init__(self, seed: int, name: str) -> None:
        self._bits = np.random.Philox(key=key(seed, name))
        self._generator = np.random.Generator(self._bits)
        # restored before each draw with another counter: a fifth of the cost of a new generator
        self._state = self._bits.state
        self._counter = np.zeros(4, dtype=np.uint64)
        self._state["state"]["counter"] = self._counter

    def normal(self, sample: int, size: int) -> NDArray[np.float64]:
        """Return `size` standard normal numbers of sample number `sample`; a smaller size gives the first of them."""
        self._counter[3] = sample & _MASK
        self._bits.state = self._state
        return self._generator.standard_normal(size)

    def bytes(self, sample: int, size: int, stream: int) -> NDArray[np.uint8]:
        """Return `size` random bytes of sample number `sample`; each `stream`, from 1 on, has its own."""
        self._counter[2:] = stream, sample & _MASK
        self._bits.state = self._state
        self._counter[2] = 0
        return np.frombuffer(self._generator.bytes(size), np.uint8)
