"""Last states of runs: where all bodies were, for the page and the pictures of an evaluation.

A worker sends its scene once, and frames while it works. So a run that is killed has a state too. The folder `states`
beside the results holds a `.state` for each run that lost points, `live.state` of a run in progress, and a `.scene` for
each of their scenes: all runs of a trial share it. A state is three fields: the digest of the scene and the name of the
run, a line each, and then `SceneFrame.encode`. Readers take these files for untrusted.
"""

import base64
import hashlib
import re
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.rendering.scene.scene import decode_frame, decode_scene, encode_scene
from cellwright.running.evaluation.results.folder import read_regular
from cellwright.running.evaluation.results.result import Result
from cellwright.util.errors import CellwrightError, printable
from cellwright.util.files import write_atomic

STATES = "states"
"""Folder beside the results."""
STATE, SCENE = ".state", ".scene"
LIVE_NAME = f"live{STATE}"
"""State of a run in progress."""

_PERIOD = 0.5  # [s] of wall time between two looks at a run that may hang
_DIGEST = re.compile("[0-9a-f]{16}")
_MAX_NAME = 200  # characters


class StateReporter:
    """Sends the scene of a cell, and frames of it; it does not affect the run.

    Args:
        cell: the cell.
        send: takes a kind, `scene` or `frame`, and its bytes as base64; several threads call it.
    """

    def __init__(self, cell: Cell, send: Callable[[str, object], None]) -> None:
        self._cell = cell
        self._send = send
        self._capture = SceneCapture.of(cell)
        self._sent = -1
        send("scene", base64.b64encode(encode_scene(self._capture.scene)).decode())
        self.report()
        threading.Thread(target=self._watch, name="states", daemon=True).start()

    def report(self) -> None:
        """Send the state now. The thread that steps calls this."""
        self._cell.simulation.refresh()
        self._send_frame()

    def _send_frame(self) -> None:
        simulation = self._cell.simulation
        self._sent = simulation.now
        frame = self._capture.frame(simulation.data, self._sent)
        self._send("frame", base64.b64encode(frame.encode()).decode())

    def _watch(self) -> None:
        """Send the state in which a program hangs: nothing steps then, and poses are at most a step old."""
        waits, seen = threading.Event(), -1
        while not waits.wait(_PERIOD):
            now = self._cell.simulation.now
            # Unchanged since the last look, and not sent yet: the run hangs.
            if now == seen != self._sent:
                try:
                    self._send_frame()
                except (OSError, ValueError, IndexError):
                    # the evaluation has ended, or the cell grows just now
                    continue
            seen = now


def loses_points(result: Result) -> bool:
    """Return whether a run has less than all attainable points, or was not done: its last state is kept."""
    return not result.is_unjudged and (not result.is_done or result.share < 1.0)


def state_file(folder: Path, log_name: str) -> Path:
    """Return the file for the last state of a run.

    Args:
        folder: that of the results.
        log_name: name of the run's log.
    """
    return folder / STATES / Path(log_name).with_suffix(STATE).name


def write_state(file: Path, name: str, scene: str, frame: str) -> None:
    """Write a state that a worker has sent, and its scene; nothing if either is missing or no base64.

    Args:
        file: the file, in the folder `states`.
        name: name of the run.
        scene: its scene, as base64.
        frame: its frame, as base64.

    Raises:
        OSError: it cannot be written.
    """
    try:
        shapes, poses = base64.b64decode(scene, validate=True), base64.b64decode(frame, validate=True)
    except ValueError:
        return
    if not shapes or not poses:
        return
    digest = hashlib.sha256(shapes).hexdigest()[:16]
    file.parent.mkdir(exist_ok=True)
    scene_file = file.with_name(f"{digest}{SCENE}")
    if not scene_file.exists():
        write_atomic(scene_file, shapes)
    line = printable(name, _MAX_NAME).replace("\n", " ")
    write_atomic(file, f"{digest}\n{line}\n".encode() + poses)


class StateError(CellwrightError):
    """A file is no state, or its scene is missing."""


@dataclass(frozen=True, slots=True)
class State:
    """State of a run.

    Attributes:
        name: name of the run.
        scene_file: file with its scene.
        scene: its scene.
        frame: poses of the scene's bodies.
    """

    name: str
    scene_file: Path
    scene: Scene
    frame: SceneFrame


def read_state(file: Path) -> State:
    """Read a state and its scene.

    Raises:
        StateError: there is none, or the file holds something else.
    """
    try:
        digest, name, poses = _parts(file)
        scene_file = file.with_name(f"{digest}{SCENE}")
        scene, frame = _scene(scene_file), decode_frame(poses)
    except FileNotFoundError:
        raise StateError("its last state is not known") from None
    except OSError as error:
        raise StateError(f"{file}: cannot be read: {error.strerror or error}") from None
    except (ValueError, CellwrightError) as error:
        raise StateError(f"{file}: not a state: {error}") from None
    if len(frame.poses) != len(scene.bodies):
        raise StateError(f"{file}: not a state: it has {len(frame.poses)} bodies of {len(scene.bodies)}")
    return State(printable(name, _MAX_NAME), scene_file, scene, frame)


def scene_file_of(file: Path) -> Path:
    """Return the file with the scene of a state.

    Raises:
        OSError: the state cannot be read.
        ValueError: it is none.
        UsageError: it is no regular file.
    """
    return file.with_name(f"{_parts(file)[0]}{SCENE}")


def _parts(file: Path) -> tuple[str, str, bytes]:
    """Return the digest of the scene, the name of the run, and the bytes of the frame."""
    digest, name, poses = read_regular(file).split(b"\n", 2)
    if not _DIGEST.fullmatch(text := digest.decode("ascii", errors="replace")):
        raise ValueError("no digest of a scene")
    return text, name.decode("utf-8", errors="replace"), poses


@lru_cache(maxsize=8)
def _scene(file: Path) -> Scene:
    return decode_scene(read_regular(file))
