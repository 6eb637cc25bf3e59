"""Snapshots in memory and checkpoints on disk, taken at declared times.

A snapshot in memory copies the engine's data whole and disturbs nothing. A checkpoint on disk can only carry what the
engine lets one save, which leaves out who sleeps; so taking one resets and restores the *live* run too, and both go on
bit for bit alike. Because that touches the run, checkpoints are taken at declared times only, which are part of its
state: a run with the same checkpoints has the same state hash, whether its files were kept, lost or never written.
"""

import copy
import hashlib
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.engine.simulation import CHANGING_FIELDS, Device, Simulation
from cellwright.util.errors import CellwrightError
from cellwright.util.files import atomic_file

_INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION
_FORMAT = 3
_LARGEST = 256 << 20  # of a file's contents [bytes]; a cell's are some hundred times smaller


class CheckpointError(CellwrightError):
    """A checkpoint file that cannot be read, or belongs to another cell."""


@dataclass(frozen=True)
class Snapshot:
    """A moment of a simulation, in memory."""

    data: mujoco.MjData
    fields: dict[str, NDArray[np.float64]]
    state: dict[str, Any]
    record: dict[str, Any]


def take_snapshot(simulation: Simulation) -> Snapshot:
    """Remember this moment. The run goes on as if nothing had been asked."""
    return Snapshot(
        data=copy.copy(simulation.data),
        fields={name: getattr(simulation.model, name).copy() for name in CHANGING_FIELDS},
        state=copy.deepcopy(simulation.get_state()),
        record=copy.deepcopy(simulation.get_record()),
    )


def restore_snapshot(simulation: Simulation, snapshot: Snapshot) -> None:
    """Go back to a moment of the same simulation, or of one built from the same description."""
    mujoco.mj_copyData(simulation.data, simulation.model, snapshot.data)
    for name, values in snapshot.fields.items():
        getattr(simulation.model, name)[:] = values
    simulation.set_state(copy.deepcopy(snapshot.state))
    simulation.set_record(copy.deepcopy(snapshot.record))


def write_checkpoint(simulation: Simulation, path: Path) -> None:
    """Save this moment to a file (.npz), and go on from the saved state.

    Every sleeping part is awake afterwards, here as in the restored run, and falls asleep again within 0.1 s.
    """
    engine = _get_engine(simulation)
    fields = {name: getattr(simulation.model, name).copy() for name in CHANGING_FIELDS}
    state = simulation.get_state()
    header = {"format": _FORMAT, "model": model_signature(simulation.model), "state": state}
    header["digest"] = _digest(engine, fields, state)
    if record := simulation.get_record():
        header |= {"record": record, "record_digest": hashlib.sha256(_as_bytes(record)).hexdigest()}
    text = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    with atomic_file(path) as file:
        np.savez_compressed(file, engine=engine, header=text, **fields)
    _set_engine(simulation, engine)


def renew_engine(simulation: Simulation) -> None:
    """Do to the run what saving it does, without writing anything."""
    _set_engine(simulation, _get_engine(simulation))


def read_checkpoint(simulation: Simulation, path: Path) -> None:
    """Continue from a saved moment, in a simulation built from the same description.

    Raises:
        CheckpointError: the file is no checkpoint, is damaged, or is one of another cell or version; the simulation is
            as it was.
    """
    try:
        header, engine, fields = _read(path)
    except Exception as error:  # a file that is damaged fails anywhere in the library
        reason = "".join(c if c.isprintable() else " " for c in str(error))[:200] or type(error).__name__
        raise CheckpointError(f"{path}: not a checkpoint that can be read ({reason})") from error
    if header.get("format") != _FORMAT or header.get("model") != model_signature(simulation.model):
        raise CheckpointError(f"{path}: the checkpoint was made with another cell or another version")
    record = header.get("record", {})  # files of earlier versions have none
    is_record_whole = not record or header.get("record_digest") == hashlib.sha256(_as_bytes(record)).hexdigest()
    if header.get("digest") != _digest(engine, fields, header.get("state")) or not is_record_whole:
        raise CheckpointError(f"{path}: the checkpoint was changed since it was written")
    for name, values in fields.items():
        getattr(simulation.model, name)[:] = values
    simulation.set_state(header["state"])
    simulation.set_record(record)
    _set_engine(simulation, engine)


def _read(path: Path) -> tuple[dict[str, Any], NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """The header, the engine's state and the fields of the model that a file holds, whatever they are."""
    if path.exists() and not path.is_file():
        raise ValueError("no plain file")  # of some there is no end
    with path.open("rb") as stream:
        with zipfile.ZipFile(stream) as archive:
            if sum(member.file_size for member in archive.infolist()) > _LARGEST:
                raise ValueError(f"more than {_LARGEST >> 20} MiB in it")
        stream.seek(0)
        with np.load(stream, allow_pickle=False) as file:
            header = json.loads(file["header"].tobytes())
            if not isinstance(header, dict):
                raise ValueError("its header is no object")
            return header, file["engine"], {name: file[name] for name in CHANGING_FIELDS}


def _digest(engine: NDArray[np.float64], fields: dict[str, NDArray[np.float64]], state: object) -> str:
    """Tells whether a file still says what was written; it keeps out slips, not somebody who means it."""
    digest = hashlib.sha256(_as_bytes(state))
    for name, array in (("engine", engine), *sorted(fields.items())):
        digest.update(f"{name} {array.dtype} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _as_bytes(values: object) -> bytes:
    """JSON values as the bytes that a digest is taken of."""
    return json.dumps(values, sort_keys=True).encode()


def model_signature(model: mujoco.MjModel) -> str:
    """A digest of what a model is made of: engine version, sizes, names and masses."""
    digest = hashlib.sha256(mujoco.__version__.encode())
    digest.update(np.array([model.nq, model.nv, model.nu, model.na, model.ngeom, model.neq], dtype=np.int64).tobytes())
    digest.update(model.names)
    digest.update(model.body_mass.tobytes())
    return digest.hexdigest()


def _get_engine(simulation: Simulation) -> NDArray[np.float64]:
    engine = np.empty(mujoco.mj_stateSize(simulation.model, _INTEGRATION))
    mujoco.mj_getState(simulation.model, simulation.data, engine, _INTEGRATION)
    return engine


def _set_engine(simulation: Simulation, engine: NDArray[np.float64]) -> None:
    mujoco.mj_resetData(simulation.model, simulation.data)
    mujoco.mj_setState(simulation.model, simulation.data, engine, _INTEGRATION)
    simulation.touch()


_LAST = 1_000_000
"""Priority among a tick's events: everything else has happened."""


class Checkpoints(Device):
    """Saves the simulation at the times that were declared before the run.

    `report` takes a line about a file that could not be written; the run goes on.
    """

    STATE = ("_times",)

    def __init__(self, report: Callable[[str], None] = lambda _line: None) -> None:
        super().__init__("checkpoints")
        self._report = report
        self.missed: list[Path] = []
        """The files that could not be written, in all runs so far."""
        self._paths: dict[int, Path | None] = {}
        self._times: list[int] = []

    def declare(self, time: int, path: Path | None) -> None:
        """Save at `time` [ns] to `path` in every run that begins from now on; None does all but write."""
        self._paths[time] = path

    def withdraw(self, time: int) -> None:
        """Save at `time` [ns] no more, in runs that begin from now on."""
        self._paths.pop(time, None)

    def reset(self) -> None:
        """Wait for the declared times."""
        self._times = sorted(self._paths)
        for time in self._times:
            self.simulation.schedule(self, "save", time, at=time, priority=_LAST)

    def handle_save(self, time: int) -> None:
        """Save."""
        path = self._paths.get(time)
        if path is None:
            renew_engine(self.simulation)
            return
        try:
            write_checkpoint(self.simulation, path)
        except OSError as error:
            self.missed.append(path)
            self._report(f"checkpoint {path}: cannot be written: {error.strerror or error}")
            renew_engine(self.simulation)
