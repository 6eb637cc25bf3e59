"""Table of an evaluation as a Parquet file: one row per run, with its parts, kits, orders and events as lists.

The package pyarrow writes it. Equal results give equal bytes with the same version of pyarrow.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from statistics import fmean
from typing import Any

from cellwright.running.evaluation.plan.job import LATENCY, repeated_key
from cellwright.running.evaluation.results.measures import MEASURES
from cellwright.running.evaluation.results.result import Result
from cellwright.running.run import versions

TABLE_NAME = "results.parquet"
FORMAT_VERSION = 1
"""Version of the columns: a column that changes its name, type or meaning raises it, a new one does not."""

_TEXT, _TRUTH, _WHOLE, _NUMBER = "text", "truth", "whole", "number"
_UNITS = ("s", "m", "rad", "points", "bytes")
"""Units of columns of numbers."""

_MEASURE_UNITS = {"time": "s", "distance": "m", "yaw_difference": "rad"}

_Columns = Mapping[str, Any]
"""Names of columns with a unit, a type of the four above, or the columns of the structures in a list."""

_OVERRIDES: _Columns = dict.fromkeys(("key", "value"), _TEXT)
_ORDERS: _Columns = {
    "order": _TEXT,
    "announced": "s",
    "completed": "s",
    "time_taken": "s",
    "is_complete": _TRUTH,
    "points": "points",
    "reachable": "points",
}
_KITS: _Columns = {
    "order": _TEXT,
    "kit": _TEXT,
    "is_submitted": _TRUTH,
    **dict.fromkeys(("points", "reachable", "best", "part_presence", "all_parts_bonus", "part_pose"), "points"),
    "bonus": _TEXT,
    "bonus_reason": _TEXT,
}
_PARTS: _Columns = {
    "order": _TEXT,
    "kit": _TEXT,
    "number": _WHOLE,
    "type": _TEXT,
    "verdict": _TEXT,
    "cause": _TEXT,
    "sentence": _TEXT,
    "object": _TEXT,
    **dict.fromkeys(("points", "presence", "pose", "reachable_presence", "reachable_pose"), "points"),
    "distance": "m",
    **dict.fromkeys(("yaw_difference", "turn"), "rad"),
}
_EXTRAS: _Columns = dict.fromkeys(("order", "kit", "name", "type", "reason"), _TEXT)
_SUBMISSIONS: _Columns = {"time": "s", "agv": _TEXT, "kit": _TEXT, "points": "points"}
_HELD: _Columns = {"begin": "s", "end": "s", "part": _TEXT, "type": _TEXT}
_AGVS: _Columns = {"agv": _TEXT, "begin": "s", "end": "s", "state": _TEXT}

COLUMNS: _Columns = {
    "trial": _TEXT,
    "overrides": [_OVERRIDES],
    "latency": "s",
    "agent": _TEXT,
    "seed": _WHOLE,
    "vary": _TRUTH,
    "over": _TEXT,
    "verified": _TRUTH,
    "is_repetition": _TRUTH,
    "outcome": _TEXT,
    "error_class": _TEXT,
    "success": _TRUTH,
    **dict.fromkeys(("points", "reachable", "best"), "points"),
    "share": _NUMBER,
    **dict.fromkeys(("simulated", "wall"), "s"),
    "steps": _WHOLE,
    **{measure.name: _MEASURE_UNITS[measure.name] for measure in MEASURES},
    "reason": _TEXT,
    "state_hash": _TEXT,
    "key": _TEXT,
    "command": _TEXT,
    "limit_wall": "s",
    "limit_start": "s",
    **dict.fromkeys(("limit_memory", "limit_log"), "bytes"),
    "orders": [_ORDERS],
    "kits": [_KITS],
    "parts": [_PARTS],
    "extras": [_EXTRAS],
    "submissions": [_SUBMISSIONS],
    "held": [_HELD],
    "agvs": [_AGVS],
    "log": [_TEXT],
}
"""Columns of the table, in order."""


def parquet_table(results: Sequence[Result]) -> bytes:
    """Return the table of these results as a file: of runs and repetitions, in the order of the plan."""
    import pyarrow
    from pyarrow import parquet

    # The key of a repetition follows from that of its run.
    repetitions = {repeated_key(result.key) for result in results}
    rows = [_row(result, is_repetition=result.key in repetitions) for result in results]
    schema = pyarrow.schema(_fields(COLUMNS), _metadata())
    content = pyarrow.BufferOutputStream()
    parquet.write_table(pyarrow.Table.from_pylist(rows, schema), content, compression="zstd")
    return bytes(content.getvalue())


def _metadata() -> dict[str, str]:
    return {"cellwright.format": str(FORMAT_VERSION), "cellwright.versions": json.dumps(versions(), sort_keys=True)}


def _fields(columns: _Columns) -> list[Any]:
    import pyarrow

    return [
        pyarrow.field(name, _type(kind), metadata={"unit": kind} if isinstance(kind, str) and kind in _UNITS else None)
        for name, kind in columns.items()
    ]


def _type(kind: Any) -> Any:
    import pyarrow

    match kind:
        case [Mapping() as columns]:
            return pyarrow.list_(pyarrow.struct(_fields(columns)))
        case [inner]:
            return pyarrow.list_(_type(inner))
    types = {_TEXT: pyarrow.string, _TRUTH: pyarrow.bool_, _WHOLE: pyarrow.int64, _NUMBER: pyarrow.float64}
    return types[_NUMBER if kind in _UNITS else kind]()


def _row(result: Result, *, is_repetition: bool) -> dict[str, Any]:
    kits = list(_kits(result))
    timeline = result.timeline
    spans = [{"agv": number, **span} for number, each in sorted(timeline.get("agvs", {}).items()) for span in each]
    values = {measure.name: measure.values(result) for measure in MEASURES}
    row = {
        **{name: getattr(result, name) for name in COLUMNS if hasattr(result, name)},
        "overrides": [{"key": key, "value": value} for key, value in result.overrides.items()],
        "latency": _latency(result),
        "is_repetition": is_repetition,
        **{name: fmean(each) if each else None for name, each in values.items()},
        **{f"limit_{name}": value for name, value in result.limits.items()},
        "orders": list(_orders(result)),
        "kits": [{**kit, "is_submitted": kit["submitted"], "points": kit["total"]} for kit in kits],
        "parts": [
            {**part, **_place(kit), "number": number, "points": part["presence"] + part["pose"]}
            for kit in kits
            for number, part in enumerate(kit["parts"], start=1)
        ],
        "extras": [{**extra, **_place(kit)} for kit in kits for extra in kit["extras"]],
        "submissions": timeline.get("kits", ()),
        "held": timeline.get("held", ()),
        "agvs": spans,
    }
    return _fitted(row, COLUMNS)


def _latency(result: Result) -> float | None:
    """Return the latency [s] of a policy where an evaluation compares fixed ones; None otherwise."""
    try:
        return float(result.overrides.get(LATENCY, "")) / 1000.0
    except ValueError:
        return None


def _kits(result: Result) -> Iterator[dict[str, Any]]:
    """Yield the evidence of each kit, with the names of its order and its own."""
    for order in result.score.get("orders", ()):
        for kit in order["kits"]:
            yield {**kit, "order": order["order_id"], "kit": kit["kit_type"]}


def _place(kit: Mapping[str, Any]) -> dict[str, str]:
    return {"order": kit["order"], "kit": kit["kit"]}


def _orders(result: Result) -> Iterator[dict[str, Any]]:
    """Yield all orders: those of the score with their times, then those that only the timeline knows."""
    times = {each["order"]: each for each in result.timeline.get("orders", ())}
    for order in result.score.get("orders", ()):
        name = order["order_id"]
        sums = {"points": order.get("total"), "is_complete": order.get("complete")}
        # in the score, `announced` is no time
        own = {"order": name, "announced": None, "completed": None}
        yield {**order, **own, **sums, **times.pop(name, {})}
    yield from times.values()


def _fitted(values: Mapping[str, Any], columns: _Columns) -> dict[str, Any]:
    return {name: _fit(values.get(name), kind) for name, kind in columns.items()}


def _fit(value: Any, kind: Any) -> Any:
    """Return a value of the type of its column; None for one of another type, in the fields that no form checks."""
    match kind:
        case [Mapping() as columns]:
            return [_fitted(each, columns) for each in value]
        case [inner]:
            return [_fit(each, inner) for each in value]
    if kind == _TEXT:
        return _text(value) if isinstance(value, str) else None
    if isinstance(value, bool) or kind == _TRUTH:
        return value if isinstance(value, bool) and kind == _TRUTH else None
    if kind == _WHOLE:
        return value
    is_number = isinstance(value, float) or (isinstance(value, int) and abs(value) <= sys.float_info.max)
    return float(value) if is_number else None


def _text(value: str) -> str:
    """Return a text that has a UTF-8 form: a lone surrogate, as of an odd file name, has none."""
    return value.encode(errors="backslashreplace").decode()
