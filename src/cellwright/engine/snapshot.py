"""Snapshots in memory and checkpoints on disk, taken at declared times.

A snapshot in memory copies the engine's data whole and disturbs nothing. A checkpoint on disk carries only what the
engine can save, which leaves out the sleep states. So taking one resets and restores the *live* run too, and both
continue bit-identically.

Because a checkpoint changes the run, its time is declared before and part of the state. Runs with the same checkpoints
have the same state hash, whether their files were kept, lost or never written.
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

from cellwright.engine.device import Device, Follower
from cellwright.engine.engine_state import CHANGING_FIELDS
from cellwright.engine.sensor import Sensor
from cellwright.engine.simulation import Simulation
from cellwright.util.errors import CellwrightError
from cellwright.util.files import atomic_file

_INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION
_FORMAT = 3
_MAX_SIZE = 256 << 20  # of a file's contents [bytes]; a cell's are a few hundred times smaller
_LAST = 1_000_000
"""Priority within a tick: after all other events."""


class CheckpointError(CellwrightError):
    """A checkpoint file that cannot be read, or belongs to another cell."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """State of a simulation at one time, in memory, with what is on its way to clients and what they know."""

    time: int
    """Simulation time [ns]."""
    data: mujoco.MjData
    fields: dict[str, NDArray[np.float64]]
    state: dict[str, Any]
    record: dict[str, Any]
    readings: dict[str, tuple[Any, ...]]
    memories: tuple[tuple[Follower, object], ...]


def take_snapshot(simulation: Simulation) -> Snapshot:
    """Take a snapshot of the simulation, without any effect on the run.

    Raises:
        UsageError: called within a tick.
    """
    simulation.refuse_within_tick()
    sensors = (each for each in simulation.devices.values() if isinstance(each, Sensor))
    return Snapshot(
        time=simulation.now,
        data=copy.copy(simulation.data),
        fields={name: getattr(simulation.model, name).copy() for name in CHANGING_FIELDS},
        state=copy.deepcopy(simulation.get_state()),
        record=copy.deepcopy(simulation.get_record()),
        readings={each.name: pending for each in sensors if (pending := tuple(each.pending))},
        memories=tuple((each, each.remember()) for each in simulation.followers),
    )


def restore_snapshot(simulation: Simulation, snapshot: Snapshot, announce: Callable[[], None] = lambda: None) -> None:
    """Restore a snapshot of the same simulation, or of one built from the same description.

    Clients that the snapshot knows know again what they knew then. All others have forgotten everything.

    Args:
        simulation: the simulation.
        snapshot: the snapshot.
        announce: called when the state is restored, and before clients remember: for messages to those that cannot.

    Raises:
        UsageError: called within a tick, or something follows the run that cannot go back in time, such as a recording.
    """
    simulation.refuse_rewind()
    for callback in simulation.on_rewind:
        callback(snapshot.time)
    simulation.runs += 1
    for follower in simulation.followers:
        follower.forget()
    # first, since a device may replace the model
    simulation.set_state(copy.deepcopy(snapshot.state))
    mujoco.mj_copyData(simulation.data, simulation.model, snapshot.data)
    for name, values in snapshot.fields.items():
        getattr(simulation.model, name)[:] = values
    simulation.set_record(copy.deepcopy(snapshot.record))
    for name, readings in snapshot.readings.items():
        sensor = simulation.device(name)
        assert isinstance(sensor, Sensor)
        sensor.pending = readings
    announce()
    for follower, memory in snapshot.memories:
        if follower in simulation.followers:
            follower.recall(memory)


def write_checkpoint(simulation: Simulation, path: Path) -> None:
    """Write a checkpoint to a file (.npz), and continue from the saved state.

    Every sleeping part is awake afterwards, here as in the restored run, and falls asleep again within 0.1 s.
    """
    _announce_renewal(simulation)
    engine = _get_engine(simulation)
    fields = {name: getattr(simulation.model, name).copy() for name in CHANGING_FIELDS}
    state = simulation.get_state()
    header = {"format": _FORMAT, "model": model_signature(simulation.first_model), "state": state}
    header["digest"] = _digest(engine, fields, state)
    if record := simulation.get_record():
        header |= {"record": record, "record_digest": hashlib.sha256(_as_bytes(record)).hexdigest()}
    text = np.frombuffer(json.dumps(header).encode(), dtype=np.uint8)
    with atomic_file(path) as file:
        np.savez_compressed(file, engine=engine, header=text, **fields)
    # The engine's saved state has no sleep. This run takes it back too, so that it and a restored one go on alike.
    _set_engine(simulation, engine)


def renew_engine(simulation: Simulation) -> None:
    """Change the run as a checkpoint does, without writing a file."""
    _announce_renewal(simulation)
    _set_engine(simulation, _get_engine(simulation))


def read_checkpoint(simulation: Simulation, path: Path) -> None:
    """Continue from a checkpoint, in a simulation built from the same description.

    Raises:
        CheckpointError: the file is no checkpoint, is damaged, or is one of another cell or version; the simulation is
            unchanged.
    """
    try:
        header, engine, fields = _read(path)
    except Exception as error:  # a damaged file can fail anywhere in the library
        reason = "".join(c if c.isprintable() else " " for c in str(error))[:200] or type(error).__name__
        raise CheckpointError(f"{path}: not a checkpoint ({reason})") from error
    if header.get("format") != _FORMAT or header.get("model") != model_signature(simulation.first_model):
        raise CheckpointError(f"{path}: the checkpoint was made with another cell or another version")
    # a run that writes no record has none
    record = header.get("record", {})
    is_record_whole = not record or header.get("record_digest") == hashlib.sha256(_as_bytes(record)).hexdigest()
    if header.get("digest") != _digest(engine, fields, header.get("state")) or not is_record_whole:
        raise CheckpointError(f"{path}: the checkpoint was changed since it was written")
    # first, since a device may replace the model
    simulation.set_state(header["state"])
    for name, values in fields.items():
        getattr(simulation.model, name)[:] = values
    simulation.set_record(record)
    _set_engine(simulation, engine)


def _read(path: Path) -> tuple[dict[str, Any], NDArray[np.float64], dict[str, NDArray[np.float64]]]:
    """Read the header, the engine's state and the model's fields from a file, without checking them."""
    if path.exists() and not path.is_file():
        # a device or pipe may have no end
        raise ValueError("not a regular file")
    with path.open("rb") as stream:
        with zipfile.ZipFile(stream) as archive:
            if sum(member.file_size for member in archive.infolist()) > _MAX_SIZE:
                raise ValueError(f"larger than {_MAX_SIZE >> 20} MiB")
        stream.seek(0)
        with np.load(stream, allow_pickle=False) as file:
            header = json.loads(file["header"].tobytes())
            if not isinstance(header, dict):
                raise ValueError("its header is not a JSON object")
            return header, file["engine"], {name: file[name] for name in CHANGING_FIELDS}


def _digest(engine: NDArray[np.float64], fields: dict[str, NDArray[np.float64]], state: object) -> str:
    """Return a digest that shows whether a file was changed; it detects accidents, not intent."""
    digest = hashlib.sha256(_as_bytes(state))
    for name, array in (("engine", engine), *sorted(fields.items())):
        digest.update(f"{name} {array.dtype} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _as_bytes(values: object) -> bytes:
    """Return JSON values as bytes for a digest."""
    return json.dumps(values, sort_keys=True).encode()


def model_signature(model: mujoco.MjModel) -> str:
    """Return a digest of a model's content: engine version, sizes, names and masses."""
    digest = hashlib.sha256(mujoco.__version__.encode())
    digest.update(np.array([model.nq, model.nv, model.nu, model.na, model.ngeom, model.neq], dtype=np.int64).tobytes())
    digest.update(model.names)
    digest.update(model.body_mass.tobytes())
    return digest.hexdigest()


def _announce_renewal(simulation: Simulation) -> None:
    for callback in simulation.on_renewal:
        callback()


def _get_engine(simulation: Simulation) -> NDArray[np.float64]:
    engine = np.empty(mujoco.mj_stateSize(simulation.model, _INTEGRATION))
    mujoco.mj_getState(simulation.model, simulation.data, engine, _INTEGRATION)
    return engine


def _set_engine(simulation: Simulation, engine: NDArray[np.float64]) -> None:
    mujoco.mj_resetData(simulation.model, simulation.data)
    mujoco.mj_setState(simulation.model, simulation.data, engine, _INTEGRATION)
    simulation.touch()


class Checkpoints(Device):
    """Device that writes checkpoints at the times declared before the run.

    Args:
        report: takes a line about a file that could not be written; the run goes on.
    """

    STATE = ("_times",)

    def __init__(self, report: Callable[[str], None] = lambda _line: None) -> None:
        super().__init__("checkpoints")
        self._report = report
        self.missed: list[Path] = []
        """Files that could not be written, in all runs so far."""
        self._paths: dict[int, Path | None] = {}
        self._times: list[int] = []

    def declare(self, time: int, path: Path | None) -> None:
        """Declare a checkpoint at `time` [ns] for all later runs, written to `path`; None does all but write."""
        self._paths[time] = path

    def withdraw(self, time: int) -> None:
        """Remove the checkpoint at `time` [ns] from all later runs."""
        self._paths.pop(time, None)

    def reset(self) -> None:
        """Schedule the declared times."""
        self._times = sorted(self._paths)
        for time in self._times:
            self.simulation.schedule(self, "save", time, at=time, priority=_LAST)

    def handle_save(self, time: int) -> None:
        """Write the checkpoint of this time."""
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
