"""Subscriptions to cameras only while there is something to see."""

from collections.abc import Callable, Sequence

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.perception import IMAGES, CameraView, Images, Sighting, wait_for_images
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import BINS, STATIONS, WORKPLACE

BIN_7 = Pose.from_rpy((-0.3, 0.23, 1.465), (0.0, 1.5708, 1.5708))


def cell(*names: str) -> Cell:
    return Cell(load_trial([find_trial(name) for name in names]).trial)


def listeners(of: Cell, name: str) -> tuple[str, ...]:
    return of.bus.topic(f"/ariac/{name}").subscribers


def take_fresh(client: Client, sensors: Sequence[Images], count: int = IMAGES) -> None:
    """Let sensors listen until each has `count` images."""
    for each in sensors:
        each.listen()
    wait_for_images(client, sensors, count)


def test_images_are_kept_after_unsubscription() -> None:
    final01 = cell("final01", "kitter_sensors")
    client = Client(InProcess(final01, node="/agent"))
    images = Images(client, "logical_camera_bin7", Catalogue(), Pose())
    client.sleep(0.5)
    assert not images.newest
    take_fresh(client, [images], 3)
    assert [round(each.time, 3) for each in images.newest] == [0.6, 0.7, 0.8]
    assert listeners(final01, images.name) == ("/agent",)
    images.rest()
    images.rest()
    client.sleep(0.5)
    assert listeners(final01, images.name) == ()
    assert len(images.newest) == 3
    images.listen()
    images.listen()
    assert not images.newest
    client.sleep(2.0)
    assert len(images.newest) == IMAGES


def test_latched_image_is_not_fresh() -> None:
    """The newest image is latched while another client listens: results must not depend on that."""
    times = []
    for is_watched in (False, True):
        final01 = cell("final01", "kitter_sensors")
        client = Client(InProcess(final01))
        if is_watched:
            client.on_sensor("logical_camera_bin7", lambda _image: None)
        client.sleep(0.55)
        camera = CameraView(client, "logical_camera_bin7", BIN_7, Catalogue(), Pose())
        take_fresh(client, [camera], 2)
        times.append([each.time for each in camera.newest])
    assert times[0] == times[1] == [0.6, 0.7]


def test_disabled_camera_ends_wait_by_timeout() -> None:
    final01 = cell("final01", "kitter_sensors")
    final01.sensors["logical_camera_bin7"].enabled = False
    client = Client(InProcess(final01))
    camera = CameraView(client, "logical_camera_bin7", BIN_7, Catalogue(), Pose())
    take_fresh(client, [camera])
    assert client.time < 1.5
    assert not camera.newest
    take_fresh(client, [])
    assert client.time < 1.5


def test_look_subscribes_only_to_needed_cameras() -> None:
    qual2b = cell("qual2b", "kitter_sensors")
    client = Client(InProcess(qual2b, node="/agent"))
    view = CellView(client, Catalogue(), WORKPLACE, {"belt": ("gasket_part",)})
    subscribed: dict[str, tuple[str, ...]] = {}
    cameras = [name for name in qual2b.sensors if "camera" in name]

    def record_subscribed() -> None:
        subscribed.update({name: listeners(qual2b, name) for name in cameras if listeners(qual2b, name)})

    record_subscribed()
    assert list(subscribed) == ["logical_camera_belt"]
    seen = look_and_call(record_subscribed, view, client)
    assert sorted(subscribed) == ["logical_camera_belt", *(f"logical_camera_bin{number}" for number in (5, 6, 7, 8))]
    assert {part.type for part in seen} == {"disk_part"}
    assert listeners(qual2b, "logical_camera_bin7") == ()
    assert listeners(qual2b, "logical_camera_belt") == ("/agent",)
    view.note_change()
    assert view.parts_in_bins() == [], "what was seen before has been forgotten"


def test_images_are_taken_again_only_after_change() -> None:
    qual2b = cell("qual2b", "kitter_sensors")
    client = Client(InProcess(qual2b, node="/agent"))
    view = CellView(client, Catalogue(), WORKPLACE, {})
    view.look(*BINS)
    first, seen = client.time, view.parts_in_bins()
    view.look(*BINS)
    assert (client.time, view.parts_in_bins()) == (first, seen)
    view.note_change()
    view.look(*BINS)
    assert client.time > first + 0.7
    assert len(view.parts_in_bins()) == len(seen)


def test_images_of_changed_area_are_taken_meanwhile() -> None:
    """The cameras listen from the change on, so that a later look need not wait for them."""
    qual2b = cell("qual2b", "kitter_sensors")
    client = Client(InProcess(qual2b, node="/agent"))
    view = CellView(client, Catalogue(), WORKPLACE, {})
    view.look(*BINS)
    view.note_change(*BINS, STATIONS[1].area)
    assert view.parts_in_bins() == []
    assert listeners(qual2b, "logical_camera_bin7") == ("/agent",)
    assert listeners(qual2b, "quality_control_sensor_1") == ("/agent",)
    assert listeners(qual2b, "quality_control_sensor_2") == ()
    client.sleep(1.0)
    now = client.time
    view.look(*BINS)
    assert view.faulty_on_tray(1) == ()
    assert client.time == now
    assert {part.type for part in view.parts_in_bins()} == {"disk_part"}
    assert listeners(qual2b, "logical_camera_bin7") == ()
    assert listeners(qual2b, "quality_control_sensor_1") == ()


def look_and_call(callback: Callable[[], None], view: CellView, client: Client) -> list[Sighting]:
    """Look at the bins, and call `callback` meanwhile."""
    leave = client.subscribe("/ariac/current_score", lambda _score: callback())
    view.look(*BINS)
    leave()
    return view.parts_in_bins()
