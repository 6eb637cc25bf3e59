"""Tests of the table of results as a Parquet file."""

from __future__ import annotations

import json
import math
from typing import Any

import pyarrow
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyarrow import parquet

from cellwright.running.evaluation.outputs.parquet import COLUMNS, FORMAT_VERSION, parquet_table
from cellwright.running.evaluation.plan.job import LATENCY, repeated_key
from cellwright.running.evaluation.results.result import Result
from cellwright.running.run import versions
from tests.running.evaluation.made_results import CRASHED, LOST, SCORE, TIMELINE, result, worked


def read(*results: Result) -> pyarrow.Table:
    return parquet.read_table(pyarrow.BufferReader(parquet_table(results)))


def rows(*results: Result) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = read(*results).to_pylist()
    return found


def test_row_has_figures_of_run() -> None:
    (row,) = rows(worked(3.0, state_hash="ab", command="cellwright run tiny", vary=True))
    expected = {"trial": "tiny", "agent": "my.py:Mine", "seed": 1, "vary": True, "is_repetition": False, "points": 3.0}
    expected |= {"share": 0.25, "simulated": 20.0, "wall": 2.0, "time": 20.0, "distance": 0.0042, "state_hash": "ab"}
    expected |= {"yaw_difference": 0.05, "key": "tiny-1", "command": "cellwright run tiny", "limit_wall": 600.0}
    assert {name: row[name] for name in expected} == expected
    assert list(row) == list(COLUMNS)


def test_lists_need_no_parsing() -> None:
    (row,) = rows(worked())
    good, missing = row["parts"]
    assert (good["order"], good["kit"], good["number"], good["type"]) == ("order_0", "order_0_kit_0", 1, "gear_part")
    assert (good["points"], good["distance"], good["verdict"]) == (2.0, 0.0042, "placed")
    assert (missing["number"], missing["points"], missing["distance"]) == (2, 0.0, None)
    assert [(kit["kit"], kit["is_submitted"], kit["points"]) for kit in row["kits"]] == [
        ("order_0_kit_0", True, 2.0),
        ("order_0_kit_1", False, 0.0),
    ]
    assert [(each["order"], each["announced"], each["completed"]) for each in row["orders"]] == [
        ("order_0", 0.0, 15.0),
        ("order_1", 5.0, None),
    ]
    assert row["extras"][0]["reason"] == "wrong type"
    assert row["held"] == [{"begin": 2.0, "end": 4.0, "part": "bin1|gear_part_1", "type": "gear_part"}]
    assert row["submissions"][1] == {"time": 19.5, "agv": "2", "kit": "<kit>", "points": 0.0}
    assert [each["agv"] for each in row["agvs"]] == ["1", "1", "1", "2"]
    assert row["agvs"][2] == {"agv": "1", "begin": 14.0, "end": None, "state": "delivering"}


def test_swept_values_are_columns_of_a_list() -> None:
    swept, whole = rows(worked(overrides={"time_limit": "60", "options": "{a: b=c}"}), worked())
    assert swept["overrides"] == [{"key": "time_limit", "value": "60"}, {"key": "options", "value": "{a: b=c}"}]
    assert whole["overrides"] == []


def test_crashed_and_lost_runs_have_rows() -> None:
    crashed, lost = rows(CRASHED, LOST)
    assert (crashed["outcome"], crashed["reason"]) == ("crashed", CRASHED.reason)
    assert tuple(crashed["log"]) == CRASHED.log
    assert (lost["time"], lost["distance"], lost["parts"], lost["held"]) == (None, None, [], [])


def test_repetition_has_a_mark() -> None:
    first = worked()
    again = worked(key=repeated_key(first.key))
    assert [row["is_repetition"] for row in rows(first, again)] == [False, True]


def test_table_without_runs_has_all_columns() -> None:
    table = read()
    assert (table.num_rows, table.column_names) == (0, list(COLUMNS))


def test_columns_have_units_and_file_has_versions() -> None:
    schema = read(worked()).schema
    units = {field.name: field.metadata[b"unit"].decode() for field in schema if field.metadata}
    expected = {**dict.fromkeys(("simulated", "wall", "time", "limit_wall"), "s"), "distance": "m"}
    expected |= {"yaw_difference": "rad", "points": "points", "limit_memory": "bytes"}
    assert {name: units.get(name) for name in expected} == expected
    part = schema.field("parts").type.value_type
    assert (part.field("distance").type, part.field("distance").metadata) == (pyarrow.float64(), {b"unit": b"m"})
    assert schema.metadata[b"cellwright.format"] == str(FORMAT_VERSION).encode()
    assert json.loads(schema.metadata[b"cellwright.versions"]) == versions()


def test_equal_results_give_equal_bytes() -> None:
    results = [worked(), CRASHED, LOST]
    assert parquet_table(results) == parquet_table([worked(), CRASHED, LOST])
    assert parquet_table(results) != parquet_table([worked(3.0), CRASHED, LOST])


@pytest.mark.parametrize("odd", ["text", ["list"], {}, True, 10**400])
def test_value_of_wrong_type_in_unchecked_field_becomes_null(odd: Any) -> None:
    score = json.loads(json.dumps(SCORE))
    score["orders"][0]["kits"][0]["parts"][0]["turn"] = odd
    score["orders"][0]["complete"] = [odd]
    score["orders"][0]["announced"] = odd
    (row,) = rows(worked(score=score))
    assert (row["parts"][0]["turn"], row["orders"][0]["is_complete"], row["orders"][0]["announced"]) == (None, None, 0)


NUMBERS = st.floats() | st.integers(-(2**53), 2**53)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]))


@given(
    st.lists(
        st.builds(
            worked,
            st.just(0.0) | NUMBERS,
            seed=st.integers(0, 2**63 - 1),
            vary=st.booleans(),
            outcome=st.sampled_from(["done", "died", "crashed"]),
            **dict.fromkeys(("trial", "agent", "key", "reason", "command", "state_hash"), TEXTS),
            **dict.fromkeys(("wall", "simulated", "reachable", "best"), NUMBERS),
            limits=st.fixed_dictionaries({}, optional={"wall": NUMBERS, "memory": NUMBERS, "other": NUMBERS}),
            score=st.sampled_from([SCORE, {}]),
            timeline=st.sampled_from([TIMELINE, {}]),
            log=st.lists(TEXTS).map(tuple),
        ),
        max_size=4,
    )
)
def test_any_results_round_trip(results: list[Result]) -> None:
    found = rows(*results)
    assert len(found) == len(results)
    for row, each in zip(found, results, strict=True):
        for name in ("trial", "agent", "key", "reason", "command", "state_hash", "outcome", "seed", "vary"):
            assert row[name] == getattr(each, name)
        for name in ("points", "wall", "simulated", "reachable", "best", "share"):
            assert same(row[name], float(getattr(each, name)))
        assert all(same(row[f"limit_{name}"], each.limits.get(name)) for name in ("wall", "memory"))
        assert row["log"] == list(each.log)
        assert (len(row["parts"]), len(row["held"])) == (2 * bool(each.score), bool(each.timeline))
        assert (row["time"] is None) == (each.outcome != "done")


def same(first: float | None, second: float | None) -> bool:
    return first == second or (first is not None and second is not None and math.isnan(first) and math.isnan(second))


def test_lone_surrogate_is_escaped() -> None:
    (row,) = rows(result(reason="no file caf\udce9"))
    assert row["reason"] == "no file caf\\udce9"


def test_success_steps_and_class_of_errors_are_columns() -> None:
    first, second = rows(result(success=True, steps=10_000), result(0.0, seed=2, outcome="unstable", success=False))
    assert (first["success"], first["steps"], first["error_class"]) == (True, 10_000, "none")
    assert (second["success"], second["steps"], second["error_class"]) == (False, 0, "simulation")
    assert rows(result())[0]["success"] is None


@pytest.mark.parametrize(("value", "latency"), [("120", 0.12), ("measured", None), ("", None)])
def test_latency_that_is_compared_is_a_column(value: str, latency: float | None) -> None:
    (row,) = rows(result(overrides={LATENCY: value} if value else {}))
    assert row["latency"] == latency
