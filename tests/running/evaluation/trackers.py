"""Trackers whose runs are on this machine: a file store of MLflow, and runs of W&B that are not uploaded."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def local_trackers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Set the variables of both trackers; return the folder of MLflow's store."""
    for name, value in {
        "MLFLOW_TRACKING_URI": (tmp_path / "mlruns").as_uri(),
        "MLFLOW_ALLOW_FILE_STORE": "true",
        "MLFLOW_EXPERIMENT_NAME": "cells",
        "MLFLOW_DISABLE_TELEMETRY": "true",
        "WANDB_MODE": "offline",
        "WANDB_PROJECT": "cells",
        **dict.fromkeys(("WANDB_DIR", "WANDB_CONFIG_DIR", "WANDB_CACHE_DIR", "WANDB_DATA_DIR"), str(tmp_path)),
    }.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("MLFLOW_EXPERIMENT_ID", raising=False)
    monkeypatch.delenv("WANDB_RUN_GROUP", raising=False)
    return tmp_path / "mlruns"


def mlflow_runs() -> list[Any]:
    """Return the runs in MLflow's store, the newest first."""
    from mlflow import MlflowClient  # takes more than a second

    client = MlflowClient()
    experiment = client.get_experiment_by_name("cells")
    return [] if experiment is None else list(client.search_runs([experiment.experiment_id]))


def mlflow_history(run: str, metric: str) -> list[tuple[int, float]]:
    """Return the steps and values of a metric, in the order in which they were logged."""
    from mlflow import MlflowClient

    return [(each.step, each.value) for each in MlflowClient().get_metric_history(run, metric)]


def wandb_runs(folder: Path) -> list[dict[str, Any]]:
    """Return the records of each run of W&B below a folder, the oldest run first."""
    files = sorted((folder / "wandb").glob("offline-run-*/*.wandb"), key=lambda file: file.stat().st_mtime_ns)
    return [_content(file) for file in files]


def _content(file: Path) -> dict[str, Any]:
    content: dict[str, Any] = {"config": {}, "history": [], "summary": {}, "files": set(), "exit": None}
    for record in _records(file.read_bytes()):
        match record.WhichOneof("record_type"):
            case "run":
                content |= {"id": record.run.run_id, "group": record.run.run_group, "project": record.run.project}
                content["host"] = record.run.host
                content["config"] |= {each.key: json.loads(each.value_json) for each in record.run.config.update}
            case "history":
                content["history"].append(_values(record.history.item))
            case "summary":
                content["summary"] |= _values(record.summary.update)
            case "artifact":
                content["files"] |= {each.path for each in record.artifact.manifest.contents}
            case "exit":
                content["exit"] = record.exit.exit_code
            case "environment" | "stats" | "output" | "output_raw":
                raise AssertionError(f"it logs the machine: {record}")
    return content


def _values(items: Any) -> dict[str, Any]:
    return {each.key or ".".join(each.nested_key): json.loads(each.value_json) for each in items}


_HEADER, _BLOCK = 7, 32768  # bytes
_WHOLE, _LAST = 1, 4  # kinds of a piece of a record: behind these a record ends


def _records(data: bytes) -> Iterator[Any]:
    """Yield the records of a file in LevelDB's format of logs, behind a header of W&B."""
    messages: Any = import_module("wandb.proto.wandb_internal_pb2")  # its classes are made when it is loaded
    position, text = _HEADER, b""
    while position + _HEADER <= len(data):
        if (left := _BLOCK - position % _BLOCK) < _HEADER:
            position += left
            continue
        size, kind = struct.unpack("<HB", data[position + 4 : position + _HEADER])
        text += data[position + _HEADER : position + _HEADER + size]
        position += _HEADER + size
        if kind in (_WHOLE, _LAST):
            record = messages.Record()
            record.ParseFromString(text)
            text = b""
            yield record
