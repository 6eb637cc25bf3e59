"""The middleware does not know its users: its sources hold no words of a cell, a robot or the engine's model."""

import re
from pathlib import Path

from cellwright import middleware

WORDS = re.compile(
    r"/ariac|agvs?\b|mujoco|mjmodel|/gazebo|io_teleop|conveyor|kit.tray|\bbelts?\b|gripper(?!command)|cellwright\.(config|rendering)",
    re.IGNORECASE,
)
OF_USERS = ("messages/osrf_gear.py", "messages/control_msgs.py", "ros1/packages/")
"""Messages of the competition and of controllers, and the packages of workspaces of 2017 and of the robot's."""


def test_sources_hold_no_words_of_users() -> None:
    folder = Path(middleware.__file__).parent
    files = {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*.py")}
    ours = {name: text for name, text in files.items() if not name.startswith(OF_USERS) and "/data/" not in name}
    found = {
        f"{name}:{number}: {match[0]}"
        for name, text in ours.items()
        for number, line in enumerate(text.splitlines(), 1)
        if (match := WORDS.search(line))
    }
    assert not found
    assert len(ours) > 80
    assert WORDS.search(files["messages/osrf_gear.py"])
