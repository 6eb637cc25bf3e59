"""Tests of the distribution: ROS 1 files stay whole, slow tests first, waiting ones beside computing ones."""

from itertools import chain
from types import SimpleNamespace
from typing import Any

import pytest

from tests.support.schedule import (
    FIRST,
    ROOT,
    SLOW,
    TOGETHER,
    WAITING,
    WHOLE,
    WORKSPACE,
    Scheduling,
    pytest_collection_modifyitems,
)

LESSON, CATKIN, LATER = (
    "tests/docs/test_lesson.py",
    "tests/ros1/test_catkin.py",
    "tests/middleware/ros1/bridge/test_b.py",
)
NAMES = ["tests/a.py::x", f"{LATER}::y", f"{LATER}::z", f"{CATKIN}::z", "tests/c.py::x", f"{LESSON}::u", f"{LESSON}::v"]


class Worker:
    """A worker as the scheduler sees it."""

    def __init__(self, number: int) -> None:
        self.gateway = SimpleNamespace(id=f"gw{number}")
        self.shutting_down = False
        self.sent: list[int] = []

    def send_runtest_some(self, indices: list[int]) -> None:
        self.sent += indices

    def shutdown(self) -> None:
        self.shutting_down = True


def in_order(names: list[str]) -> list[str]:
    items: list[Any] = [SimpleNamespace(nodeid=name) for name in names]
    pytest_collection_modifyitems(items)
    return [item.nodeid for item in items]


def run(names: list[str], count: int) -> list[list[str]]:
    """Return the tests that each worker ran, if every test takes as long as the others."""
    config: Any = SimpleNamespace(
        option=SimpleNamespace(), getvalue=lambda _: ["popen"] * count, getoption=lambda _: ["popen"] * count
    )
    scheduling, workers = Scheduling(config, None), [Worker(number) for number in range(count)]
    for worker in workers:
        scheduling.add_node(worker)
        scheduling.add_node_collection(worker, names)
    scheduling.schedule()
    done = [0] * count
    while any(len(worker.sent) > so_far for worker, so_far in zip(workers, done, strict=True)):
        for number, worker in enumerate(workers):
            if done[number] < len(worker.sent):
                done[number] += 1
                scheduling.mark_test_complete(worker, worker.sent[done[number] - 1])
    assert scheduling.tests_finished
    return [[names[index] for index in worker.sent] for worker in workers]


def test_in_order_sorts_tests_by_kind() -> None:
    assert [NAMES.index(name) for name in in_order(NAMES)] == [5, 6, 3, 1, 2, 0, 4]


def test_page_tests_run_after_lessons() -> None:
    page = [f"{TOGETHER}test_a.py::x", f"{TOGETHER}test_b.py::x"]
    others = [f"tests/d.py::{number}" for number in range(10)]
    names = in_order([*page, f"{LESSON}::u", *others])
    assert names == [f"{LESSON}::u", *others[:5], *page, *others[5:]]


def test_files_with_shared_fixtures_stay_whole() -> None:
    scheduling = Scheduling.__new__(Scheduling)
    assert scheduling._split_scope(f"{SLOW[0]}::y") == SLOW[0]
    files = [f"{name}test_b.py" if name.endswith("/") else name for name in WHOLE]
    assert [scheduling._split_scope(f"{name}::y") for name in files] == files
    assert scheduling._split_scope("tests/ros1/test_b.py::y[a::b]") == "tests/ros1/test_b.py"
    assert scheduling._split_scope("tests/kitting/test_b.py::y") == "tests/kitting/test_b.py::y"


def test_page_tests_go_to_one_worker() -> None:
    scheduling = Scheduling.__new__(Scheduling)
    assert scheduling._split_scope("tests/browser/test_a.py::y") == TOGETHER
    assert scheduling._split_scope("tests/browser/test_b.py::z") == TOGETHER


def test_workspace_tests_go_to_one_worker() -> None:
    scheduling = Scheduling.__new__(Scheduling)
    unit = scheduling._split_scope(f"{WORKSPACE[0]}_as_a_page")
    assert unit == scheduling._split_scope("tests/ros1/test_catkin.py::y")
    assert unit != scheduling._split_scope("tests/docs/test_lesson.py::test_notebook_equals_pages")
    folder, _, name = WORKSPACE[0].partition("::")
    assert f"def {name}" in (ROOT / folder).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [*FIRST, *WHOLE, *chain(*WAITING)])
def test_named_files_exist(name: str) -> None:
    assert (ROOT / name).exists()


def test_two_workers_run_all_tests_in_order() -> None:
    names = in_order(NAMES)
    one, other = run(names, 2)
    assert sorted([*one, *other]) == sorted(names)
    assert names.index(one[0]) + names.index(other[0]) == 1


def test_last_of_three_workers_takes_waiting_tests() -> None:
    names = in_order([*NAMES, *(f"tests/d.py::{number}" for number in range(40))])
    *others, last = run(names, 3)
    waiting = [name for name in names if name.startswith((LESSON, CATKIN, LATER))]
    assert last[: len(waiting)] == waiting
    assert len(last) > len(waiting)  # then it helps
    assert sorted(chain(*others, last)) == sorted(names)


def test_two_of_four_workers_take_waiting_tests_of_a_kind_each() -> None:
    ros2 = [f"tests/ros2/test_a.py::{number}" for number in range(9)]
    names = in_order([*NAMES, *ros2, *(f"tests/d.py::{number}" for number in range(80))])
    first, second, third, last = run(names, 4)
    assert third[0] in ros2
    assert not {*first, *second} & {*ros2}
    ros1 = [name for name in names if name.startswith((LESSON, CATKIN, LATER))]
    assert last[: len(ros1)] == ros1
    assert sorted([*first, *second, *third, *last]) == sorted(names)


def test_worker_without_computing_tests_takes_waiting_tests() -> None:
    names = in_order([f"{LESSON}::{number}" for number in range(30)])
    shares = run(names, 3)
    assert sorted(chain(*shares)) == sorted(names)
    assert min(map(len, shares)) > 5
