"""Competition mode for ROS 1 clients: the cell refuses cheats by the caller's node name."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import load_cases
from tests.ros1.ground import Ground, ground
from tests.ros1.test_contract import OURS
from tests.support.waiting import TIMEOUT, has_publisher, wait_until

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
    """The lesson in competition mode; in lockstep, so that times are exact."""
    with ground(tmp_path_factory.mktemp("competition"), ros1_messages) as made:
        made.serve("lesson", "--lockstep")
        yield made


def take_part(cheats: dict[str, str]) -> dict[str, Any]:
    """Start the competition with subscriptions, as a program does, then cheat; times are simulation time."""
    import genpy
    import rospy
    import rosservice
    import yaml
    from cellwright_msgs.srv import Step
    from osrf_gear.msg import Order, TrayContents
    from std_msgs.msg import String
    from std_srvs.srv import Trigger

    # No node on simulation time: it would wait for time that only it advances.
    rospy.init_node("team")
    heard: dict[str, list[str]] = {"orders": [], "late": [], "states": [], "trays": []}
    step = rospy.ServiceProxy("/cellwright/step", Step, persistent=True)
    start = rospy.ServiceProxy("/ariac/start_competition", Trigger)
    for service in (step, start):
        service.wait_for_service(TIMEOUT)
    subscribers = [
        rospy.Subscriber("/ariac/orders", Order, lambda message: heard["orders"].append(message.order_id)),
        rospy.Subscriber("/ariac/competition_state", String, lambda message: heard["states"].append(message.data)),
        rospy.Subscriber("/ariac/trays", TrayContents, lambda message: heard["trays"].append(message.tray)),
    ]
    wait_until(lambda: all(has_publisher(each) for each in subscribers), "connections")

    def let_pass(periods: int) -> None:
        """Advance time by tenths of a second, the period of the competition state."""
        for _ in range(periods):
            before = len(heard["states"])
            assert step(rospy.Duration(0, 100_000_000), [], []).success
            wait_until(lambda: len(heard["states"]) > before, "competition state", seen=lambda: heard)  # noqa: B023

    let_pass(2)
    answers = [start()]
    let_pass(2)
    wait_until(lambda: heard["orders"], "order")
    rospy.Subscriber("/ariac/orders", Order, lambda message: heard["late"].append(message.order_id))
    wait_until(lambda: heard["late"], "order for one that comes late")
    answers.append(start())
    let_pass(25)

    def call(name: str, text: str) -> Any:
        kind = rosservice.get_service_class_by_name(name)
        request = kind._request_class()
        genpy.message.fill_message_args(request, [yaml.safe_load(text)])
        return rospy.ServiceProxy(name, kind)(request)

    return {
        **heard,
        "answers": [[answer.success, answer.message] for answer in answers],
        "cheats": {name: call(name, text).success for name, text in cheats.items()},
    }


@pytest.fixture(scope="module")
def found(cell: Ground) -> dict[str, Any]:
    """Results of a team that started the competition, and cheated."""
    seen: dict[str, Any] = cell.client(take_part, CHEATS).value()
    return seen


def test_start_competition_answers_as_in_2017(found: dict[str, Any]) -> None:
    assert found["answers"] == [
        [True, "competition started successfully!"],
        [False, "cannot start if not in 'init' state"],
    ]
    states = found["states"]
    assert states[:2] == ["init", "init"]
    assert set(states[states.index("go") :]) == {"go"}
    assert states.index("go") <= 4
    assert found["orders"] == ["order_0"]
    assert found["late"] == ["order_0"]


def test_names_are_those_of_development_without_population(cell: Ground) -> None:
    publishers, subscribers, services = (dict(role) for role in cell.ask("getSystemState"))
    topics = {case["name"] for case in CASES if case["kind"] == "topic"}
    assert topics <= {*publishers, *subscribers}
    expected = {case["name"] for case in CASES if case["kind"] == "service"}
    absent = {case["name"] for case in CASES if case.get("development_only")}
    assert absent == {"/ariac/population/control"}
    assert {name for name in services if name.startswith("/ariac") and not name.startswith(OURS)} == expected - absent


def test_gazebo_services_are_disabled(cell: Ground) -> None:
    assert cell.ask("getParam", "/gazebo/enable_ros_network") is False


@pytest.mark.parametrize("service", CHEATS)
def test_cheat_service_is_refused(cell: Ground, found: dict[str, Any], service: str) -> None:
    assert found["cheats"][service] is False
    who = rf"refused {service} from /team: not allowed in a competition"
    wait_until(lambda: re.search(who, cell.log()), f"word about {service}", seen=cell.log)


def test_cheats_of_contract_are_all_tested() -> None:
    marked = {case["name"] for case in CASES if case.get("cheat") and not case.get("development_only")}
    assert marked == set(CHEATS)


def test_trays_topic_is_silent(found: dict[str, Any]) -> None:
    """Without competition mode they publish once a second."""
    assert len(found["states"]) > 25
    assert found["trays"] == []
