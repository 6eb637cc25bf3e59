"""Shared render process: one for all cells and robots of this process, with one renderer for equal scenes."""

from __future__ import annotations

import hashlib
import os
import pickle
import threading
from concurrent.futures import Future

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.picture import PictureRequest
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.worker.client import RenderWorker


class _SharedProcess:
    """The process, its scenes by content, and the count of users of each."""

    def __init__(self) -> None:
        self.worker = RenderWorker()
        self.users = 0
        self.scenes: dict[bytes, tuple[int, Future[str]]] = {}
        self.scene_users: dict[bytes, int] = {}
        self.count = 0


_lock = threading.RLock()  # a collected user closes its renderer in any thread, also in one that opens another
_process: _SharedProcess | None = None


class SharedRenderer:
    """Renderer of a scene in the shared process, which starts with the first user and ends with the last one.

    Args:
        scene: the scene to draw.

    Raises:
        UsageError: the environment sets a backend that does not exist.

    Attributes:
        ready: future name of the process's renderer.

    Example:
        >>> from cellwright.rendering.scene import Scene
        >>> first, second = (SharedRenderer(Scene("", ("world",), (), ())) for _ in range(2))
        >>> first.worker is second.worker
        True
        >>> first.close()
        >>> second.close()
    """

    def __init__(self, scene: Scene) -> None:
        global _process
        self._key = hashlib.blake2b(pickle.dumps(scene, pickle.HIGHEST_PROTOCOL)).digest()
        with _lock:
            if _process is None or _process.worker.error:
                _process = _SharedProcess()
            self._process = process = _process
            process.users += 1
            if self._key not in process.scenes:
                process.count += 1
                process.scenes[self._key] = process.count, process.worker.ask("scene", process.count, scene)
            self._number, self.ready = process.scenes[self._key]
            process.scene_users[self._key] = process.scene_users.get(self._key, 0) + 1
        self._is_closed = False

    @property
    def worker(self) -> RenderWorker:
        """The shared process."""
        return self._process.worker

    def colour(self, frame: SceneFrame, request: PictureRequest) -> Future[NDArray[np.uint8]]:
        """See `RenderWorker.colour`."""
        return self.worker.colour(frame, request, self._number)

    def depth(self, frame: SceneFrame, request: PictureRequest) -> Future[NDArray[np.float32]]:
        """See `RenderWorker.depth`."""
        return self.worker.depth(frame, request, self._number)

    def close(self, timeout: float = 20.0) -> None:
        """Stop use; the last user lets the process finish its requests within `timeout` [s]."""
        global _process
        with _lock:
            if self._is_closed:
                return
            self._is_closed = True
            process = self._process
            process.users -= 1
            process.scene_users[self._key] -= 1
            if not process.scene_users[self._key]:
                del process.scenes[self._key], process.scene_users[self._key]
                process.worker.ask("forget", self._number)
            if process.users:
                return
            if _process is process:
                _process = None
        process.worker.close(timeout)


def _leave_to_parent() -> None:
    """Forget the process in a fork, which has no thread that reads its answers."""
    global _lock, _process
    _lock, _process = threading.RLock(), None


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_parent)
