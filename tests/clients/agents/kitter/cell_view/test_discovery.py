"""Discovery of sensors, by frames and messages alone."""

from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.cell_view import CellView, find_sensors
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import BINS, STATIONS, WORKPLACE


def client(*names: str) -> Client:
    cell = Cell(load_trial([find_trial(name) for name in names]).trial)
    return Client(InProcess(cell, node="/agent"))


def test_find_sensors_in_lesson_finds_cameras_and_beam() -> None:
    cameras, beams = find_sensors(client("lesson"), Pose())
    assert sorted(cameras) == ["logical_camera", "logical_camera_over_agv1"]
    assert list(beams) == ["break_beam"]
    assert beams["break_beam"].position == pytest.approx((1.6, 2.25, 0.91))
    assert cameras["logical_camera_over_agv1"].position == pytest.approx((0.3, 3.15, 1.5))


def test_find_sensors_without_sensors_is_empty() -> None:
    assert find_sensors(client("qual1a"), Pose()) == ({}, {})


def test_find_sensors_asks_no_camera_for_a_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    subscribed: list[str] = []
    pick = client("pick_from_bin")
    subscribe = pick.transport.subscribe

    def noted(topic: str, *arguments: Any, **keywords: Any) -> Any:
        subscribed.append(topic)
        return subscribe(topic, *arguments, **keywords)

    monkeypatch.setattr(pick.transport, "subscribe", noted)
    cameras, _ = find_sensors(pick, Pose())
    assert "/ariac/overhead/image_raw" in pick.transport.topics()
    assert sorted(cameras) == sorted(each.removeprefix("/ariac/") for each in subscribed if "logical" in each)
    assert not [each for each in subscribed if each.startswith(("/ariac/overhead", "/ariac/wrist"))]


def test_parts_in_bins_are_seen_once_at_their_places() -> None:
    lesson = client("lesson")
    qual3a = client("qual3a", "kitter_sensors")
    view = CellView(qual3a, Catalogue(), WORKPLACE, {})
    view.look(*BINS)
    parts = view.parts_in_bins()
    counts = {kind: sum(part.type == kind for part in parts) for kind in ("gear_part", "disk_part", "gasket_part")}
    assert counts == {"gear_part": 16, "disk_part": 4, "gasket_part": 4}
    disk = min((part for part in parts if part.type == "disk_part"), key=lambda part: sum(part.world_T_part.position))
    assert disk.world_T_part.position == pytest.approx((-0.4, 0.895, 0.725), abs=0.002)
    assert not CellView(lesson, Catalogue(), WORKPLACE, {}).sees(Pose((-0.3, 0.995, 0.725)))  # no camera over bin 8


def test_tray_in_view_is_empty_at_start() -> None:
    view = CellView(client("qual1a", "kitter_sensors"), Catalogue(), WORKPLACE, {})
    view.look(STATIONS[1].area)
    assert view.sees(Pose((0.2, 3.35, 0.755)))
    assert view.parts_on_tray(STATIONS[1]) == []
    assert view.faulty_on_tray(1) == ()
