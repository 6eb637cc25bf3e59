"""Competition mode as ROS 1 clients find it: what counts as cheating is refused by the caller's node name."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import load_cases
from tests.ros1.ground import Ground, ground
from tests.waiting import wait_until

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

CASES = load_cases("gear_ros1_cases.json")
TRAY = "agv1::kit_tray_1::kit_tray_1::tray"

CHEATS = {
    "/ariac/conveyor/control": "{state: {power: 0}}",
    "/ariac/submit_tray": f"{{tray_id: '{TRAY}', kit_type: order_0_kit_0}}",
    "/ariac/kit_tray_1/clear_tray": "{}",
    "/ariac/kit_tray_2/clear_tray": "{}",
}


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    """The lesson, its competition started."""
    with ground(tmp_path_factory.mktemp("competition"), ros1_messages) as made:
        made.serve("lesson")
        yield made


def start_and_watch() -> dict[str, Any]:
    """Start the competition with ears open, as a program does; times are simulation time."""
    import threading

    import rospy
    from osrf_gear.msg import Order
    from std_msgs.msg import String
    from std_srvs.srv import Trigger

    rospy.init_node("team", anonymous=True)
    heard, change = {"orders": [], "late": [], "states": []}, threading.Condition()  # type: ignore[var-annotated]

    def note(kind: str, what: str) -> None:
        with change:
            heard[kind].append((what, rospy.get_time()))
            change.notify_all()

    def states() -> list[str]:
        return [what for what, _ in heard["states"]]

    rospy.Subscriber("/ariac/orders", Order, lambda message: note("orders", message.order_id))
    rospy.Subscriber("/ariac/competition_state", String, lambda message: note("states", message.data))
    with change:
        assert change.wait_for(lambda: "init" in states(), 10.0)
    start = rospy.ServiceProxy("/ariac/start_competition", Trigger)
    answers = [start()]
    begun = rospy.get_time()
    with change:
        assert change.wait_for(lambda: "go" in states() and heard["orders"], 10.0)
    rospy.Subscriber("/ariac/orders", Order, lambda message: note("late", message.order_id))
    with change:
        assert change.wait_for(lambda: heard["late"], 10.0)
    answers.append(start())
    rospy.sleep(1.0)
    return {
        "answers": [[answer.success, answer.message] for answer in answers],
        "begun": begun,
        "orders": heard["orders"],
        "late": heard["late"],
        "go": next(time for what, time in heard["states"] if what == "go"),
    }


def test_the_start_as_programs_of_the_time_expect_it(cell: Ground) -> None:
    found = cell.client(start_and_watch).value()
    assert found["answers"] == [
        [True, "competition started successfully!"],
        [False, "cannot start if not in 'init' state"],
    ]
    assert found["go"] - found["begun"] < 0.5
    assert [what for what, _ in found["orders"]] == ["order_0"]
    assert [what for what, _ in found["late"]] == ["order_0"]


def test_names_are_those_of_development_but_for_the_population(cell: Ground) -> None:
    publishers, subscribers, services = (dict(role) for role in cell.ask("getSystemState"))
    topics = {case["name"] for case in CASES if case["kind"] == "topic"}
    assert topics <= {*publishers, *subscribers}
    expected = {case["name"] for case in CASES if case["kind"] == "service"}
    absent = {case["name"] for case in CASES if case.get("development_only")}
    assert absent == {"/ariac/population/control"}
    assert {name for name in services if name.startswith("/ariac")} == expected - absent


def test_the_simulators_own_services_are_shut_off(cell: Ground) -> None:
    assert cell.ask("getParam", "/gazebo/enable_ros_network") is False


@pytest.mark.parametrize("service", CHEATS)
def test_cheats_are_refused(cell: Ground, service: str) -> None:
    said = len(cell.log())
    assert "success: False" in cell.tool("rosservice", "call", service, CHEATS[service])
    who = rf"refused {service} from /rosservice\w+: not allowed in a competition"
    wait_until(lambda: re.search(who, cell.log()[said:]), f"word about {service}")


def test_every_cheat_is_among_them() -> None:
    marked = {case["name"] for case in CASES if case.get("cheat") and not case.get("development_only")}
    assert marked == set(CHEATS)


def listen_to_trays() -> int:
    """How many messages come within two seconds of simulation."""
    import rospy
    from osrf_gear.msg import TrayContents

    rospy.init_node("peeping", anonymous=True)
    heard: list[Any] = []
    rospy.Subscriber("/ariac/trays", TrayContents, heard.append)
    rospy.sleep(2.5)
    return len(heard)


def test_the_trays_say_nothing(cell: Ground) -> None:
    assert cell.client(listen_to_trays).value() == 0
