"""Tests of the function that a node gets, without Ray."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest

from cellwright.running.evaluation.execution.on_ray import driver


@pytest.mark.parametrize(("order", "kind"), [({"check": {}}, "checked"), ({"key": "one"}, "failure")])
def test_node_without_cellwright_is_named(order: dict[str, object], kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(
        sys.modules, "ray", SimpleNamespace(util=SimpleNamespace(get_node_ip_address=lambda: "10.1.1.1"))
    )
    monkeypatch.setitem(sys.modules, "cellwright.running.evaluation.execution.on_ray", None)
    done = driver._make_task()(order)
    assert list(done) == [kind]
    assert done[kind].startswith("node 10.1.1.1: ")
    assert done[kind].endswith("; install the same Cellwright on all nodes")
