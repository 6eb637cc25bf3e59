"""Measuring clients, here without ROS 1, to see the results of failures."""

import sys
from pathlib import Path

import pytest

from benchmarks import ros1_clients
from benchmarks.ros1_clients import Clients
from tests.support.waiting import TIMEOUT

# the clients sleep only so that they live on
HEAD = "import sys, time\nif sys.argv[1] == 'echo':\n    print('ready', flush=True)\n    time.sleep(600)\n"


def clients_of(folder: Path) -> Clients:
    return Clients(sys.executable, {}, folder, trips=("kept",), calls=2, rounds=1, messages={"50 Hz": 3})


def ran(clients: Clients) -> Clients:
    clients.start()
    clients._thread.join(TIMEOUT)
    assert clients.is_done
    return clients


def test_clients_measure_each_trip_in_turn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros1_clients, "CLIENT", HEAD + "print([float(sys.argv[3])])\n")
    clients = ran(clients_of(tmp_path))
    assert (clients.figures, clients.error) == ({"kept /bare": [2.0], "kept /bench": [2.0], "50 Hz": [3.0]}, "")


def test_failing_client_gives_error_and_ends_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros1_clients, "CLIENT", HEAD)
    assert ran(clients_of(tmp_path)).error


def test_slow_client_times_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros1_clients, "CLIENT", HEAD + "time.sleep(600)\n")
    monkeypatch.setattr(ros1_clients, "LIMIT", 0.2)
    assert "timed out" in ran(clients_of(tmp_path)).error
