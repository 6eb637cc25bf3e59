"""Which worker gets what: files of ROS 1 whole, the longest first; all else one by one, in order."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from tests.ros1.schedule import LONGEST, Scheduling, pytest_collection_modifyitems


def test_order() -> None:
    names = ["tests/a.py::x", "tests/ros1/test_b.py::y", f"{LONGEST}::z", "tests/c.py::x", "tests/bridges/ros1/d.py::y"]
    items: list[Any] = [SimpleNamespace(nodeid=name) for name in names]
    pytest_collection_modifyitems(items)
    assert [names.index(item.nodeid) for item in items] == [2, 1, 4, 0, 3]


def test_files_of_ros1_stay_whole() -> None:
    scheduling = Scheduling.__new__(Scheduling)
    assert scheduling._split_scope("tests/ros1/test_b.py::y[a::b]") == "tests/ros1/test_b.py"
    assert scheduling._split_scope("tests/kitting/test_b.py::y") == "tests/kitting/test_b.py::y"


def test_those_of_the_page_go_to_one_worker() -> None:
    scheduling = Scheduling.__new__(Scheduling)
    assert scheduling._split_scope("tests/browser/test_a.py::y") == scheduling._split_scope(
        "tests/browser/test_b.py::z"
    )


def test_the_longest_file_is_there() -> None:
    assert (Path(__file__).parents[2] / LONGEST).is_file()
