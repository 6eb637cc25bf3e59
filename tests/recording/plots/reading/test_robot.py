"""Plot data of a robot besides its joints."""

import numpy as np

from cellwright.middleware.messages.cellwright_msgs import TeleopStatus
from cellwright.middleware.messages.standard import Header, Point, Pose, PoseArray, Quaternion, Time
from cellwright.recording.format.format import PANEL
from cellwright.recording.plots.reading.robot import About, Status, Tips
from tests.recording.plots.reading.recordings import message, text

ROBOT = {
    "joints": [{"name": "a", "unit": "rad"}, {"name": "b", "unit": "m"}],
    "groups": [{"name": "right arm", "joints": [1, 0]}],
    "arms": [{"name": "right", "reference": "base_link"}],
    "grippers": ["right", "left"],
}


def status(**values: object) -> TeleopStatus:
    flags = {"enabled": True, "emergency_stop": False, "resetting": False, "silent": False, "commander": ""}
    counts = {"taken": 0, "refused": 0, "ignored": 0, "unknown_names": [], "message": ""}
    return TeleopStatus(**{**flags, **counts, **values})  # type: ignore[arg-type]


def poses(*points: tuple[float, float, float]) -> PoseArray:
    header = Header(stamp=Time(sec=0, nanosec=0), frame_id="")
    turn = Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)
    return PoseArray(header=header, poses=[Pose(position=Point(x=x, y=y, z=z), orientation=turn) for x, y, z in points])


def test_status_shows_strongest_obstacle_to_commands() -> None:
    reader = Status()
    statuses = [
        status(),
        status(silent=True),
        status(enabled=False, silent=True),
        status(emergency_stop=True, enabled=False),
        status(resetting=True),
        status(commander="/keyboard"),
    ]
    for time, each in enumerate(statuses):
        reader.take(message(time, each))
    assert [span.label for span in reader.safety.until(9.0)] == [
        "takes commands",
        "no commands: holds",
        "disabled",
        "emergency stop",
        "on its way home",
        "takes commands",
    ]
    assert [(span.begin, span.label) for span in reader.commander.until(9.0)] == [(5.0, "/keyboard")]


def test_tips_give_path_of_each_arm() -> None:
    reader = Tips()
    for number in range(100):
        reader.take(message(number / 100, poses((number, 0.0, 1.0), (0.0, number, 2.0))))
    reader.take(message(2.0, poses((0.0, 0.0, 0.0))))  # of another robot: skipped
    right, left = reader.tracks([{"name": "right", "reference": "base_link"}])
    assert (right.name, right.frame, left.name) == ("right tip", "base_link", "left tip")
    assert 40 <= len(right.times) <= 51
    assert np.allclose(right.positions[:, 0], right.times * 100)
    assert (left.positions[:, 1] == right.positions[:, 0]).all()


def test_tips_without_poses_give_no_paths() -> None:
    reader = Tips()
    assert reader.tracks([]) == []
    reader.take(message(0.0, poses()))
    assert reader.tracks([]) == []


def test_first_robot_description_counts() -> None:
    about = About()
    for panel in ({"kind": "robot"}, {"robot": ROBOT}, {"robot": {"groups": 3}}):
        about.take(text(0.0, PANEL, panel))
    assert about.groups() == {"right arm": ["b", "a"]}
    assert about.units() == {"a": "rad", "b": "m"}
    assert about.arms() == ROBOT["arms"]
    assert about.grippers() == ["right", "left"]


def test_invalid_robot_description_counts_as_empty() -> None:
    about = About()
    about.take(text(0.0, PANEL, {"robot": {"joints": [], "groups": [{"name": "x", "joints": [7]}], "arms": 3}}))
    assert about.groups() == {}
    assert about.arms() == []
