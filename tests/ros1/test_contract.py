"""Interface for ROS 1 clients: names, types, checksums, latches, rates, and the node graph.

The expected values are in tests/data/gear_ros1_cases.json, for the trial `lesson`.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from cellwright.cell.interface.rows import rows
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.bus import Direction
from cellwright.middleware.interface.table import EndpointKind
from cellwright.middleware.messages import TYPES
from tests.conftest import load_cases
from tests.ros1.ground import Ground, ground
from tests.ros1.handshake import publisher_header, service_header
from tests.ros1.meters import count_messages, subscriber_headers

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

CASES = load_cases("gear_ros1_cases.json")
TOPICS = [case for case in CASES if case["kind"] == "topic"]
SERVICES = [case for case in CASES if case["kind"] == "service"]
SAID = [case for case in TOPICS if case["direction"] == "out"]
TAKEN = [case for case in TOPICS if case["direction"] == "in"]

EVERY_STEP = [case for case in SAID if case["rate"] == "step"]
SLOWER = [case for case in SAID if case["rate"] not in (None, "step")]
STEPS = 500
"""Steps of the cell in a second of simulation time."""
SECONDS = 2
"""Simulation time in which messages are counted [s]."""
OURS = ("/cellwright/", "/ariac/controller_manager/")
"""Prefixes of names that the original lacks, and of those that belong to its `ros_control` and not to its contract."""


def name(case: dict[str, Any]) -> str:
    return str(case["name"])


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> Iterator[Ground]:
    """The lesson in development mode, its competition not started."""
    with ground(tmp_path_factory.mktemp("contract"), ros1_messages) as made:
        made.serve("lesson", "-d")
        yield made


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory, ros1_messages: Path) -> dict[str, dict[str, int]]:
    """Numbers of messages of each topic, by publisher, in `SECONDS` of simulation; in lockstep none is lost or late."""
    topics = [case["name"] for case in SAID if case["rate"] is not None]
    with ground(tmp_path_factory.mktemp("rates"), ros1_messages) as made:
        made.serve("lesson", "-d", "--lockstep")
        found: dict[str, dict[str, int]] = made.client(count_messages, topics, SECONDS).value()
    return found


def graph(cell: Ground) -> tuple[dict[str, list[str]], dict[str, list[str]], dict[str, list[str]]]:
    """Return publishers, subscribers and service nodes by name, without what every node has."""
    loggers = ("/get_loggers", "/set_logger_level")
    publishers, subscribers, services = (dict(role) for role in cell.ask("getSystemState"))
    for role in (publishers, subscribers):
        role.pop("/rosout", None)
        role.pop("/rosout_agg", None)
    return publishers, subscribers, {key: nodes for key, nodes in services.items() if not key.endswith(loggers)}


def test_rows_of_table_match_contract() -> None:
    trial = load_trial([find_trial("lesson")]).trial
    found = {
        (row.name, "service" if row.kind is EndpointKind.SERVICE else "topic", row.type, TYPES.md5(row.type))
        for row in rows(trial, competition=False)
        if row.kind is not EndpointKind.ACTION and not row.name.startswith(OURS)
    }
    assert found == {(case["name"], case["kind"], case["type"], case["md5"]) for case in CASES}
    for row in rows(trial, competition=False):
        if row.kind is EndpointKind.TOPIC and not row.name.startswith(OURS):
            (case,) = [case for case in TOPICS if case["name"] == row.name]
            assert case["direction"] == ("out" if row.direction is Direction.OUT else "in"), row.name
            assert case.get("latch", False) == row.latch, row.name


def test_lesson_has_step_of_contract() -> None:
    assert load_trial([find_trial("lesson")]).trial.settings.timestep == (1, STEPS)


def test_graph_has_names_of_contract_only(cell: Ground) -> None:
    publishers, subscribers, services = graph(cell)
    of_the_time = [each for each in {*publishers, *subscribers} if not each.startswith(OURS)]
    assert sorted(of_the_time) == sorted(map(name, TOPICS))
    services_of_the_time = [each for each in services if not each.startswith(OURS)]
    assert sorted(services_of_the_time) == sorted(map(name, SERVICES))
    assert {"/cellwright/part_types", "/cellwright/solids", "/cellwright/layout"} <= set(services)


@pytest.mark.parametrize("case", TOPICS, ids=name)
def test_topic_has_publishers_and_subscribers_of_contract(cell: Ground, case: dict[str, Any]) -> None:
    publishers, subscribers, _ = graph(cell)
    assert sorted(publishers.get(case["name"], [])) == case["publishers"]
    assert sorted(subscribers.get(case["name"], [])) == case["subscribers"]
    assert dict(cell.ask("getTopicTypes"))[case["name"]] == case["type"]


@pytest.mark.parametrize("case", SAID, ids=name)
def test_publisher_header_matches_contract(cell: Ground, case: dict[str, Any]) -> None:
    for node in case["publishers"]:
        header = publisher_header(cell, case["name"], node)
        assert (header["type"], header["md5sum"]) == (case["type"], case["md5"])
        assert header["callerid"] == node
        assert (header.get("latching", "0") == "1") == case["latch"]
        assert md5_of(header["message_definition"], case["type"]) == case["md5"]


def md5_of(definition: str, kind: str) -> str:
    """Return the checksum of a definition, by another library."""
    store = get_typestore(Stores.EMPTY)
    full = kind.replace("/", "/msg/")
    store.register(get_types_from_msg(definition, full))
    return store.generate_msgdef(full, ros_version=1)[1]


def test_subscriber_headers_match_contract(cell: Ground) -> None:
    headers = cell.client(subscriber_headers, {case["name"]: case["type"] for case in TAKEN}).value()
    for case in TAKEN:
        (header,) = headers[case["name"]]
        assert (header["type"], header["md5sum"], header["callerid"]) == (case["type"], case["md5"], "/gazebo")


@pytest.mark.parametrize("case", SERVICES, ids=name)
def test_service_header_matches_contract(cell: Ground, case: dict[str, Any]) -> None:
    assert graph(cell)[2][case["name"]] == [case["node"]]
    header = service_header(cell, case["name"])
    assert (header["type"], header["md5sum"], header["callerid"]) == (case["type"], case["md5"], case["node"])
    assert header["request_type"] == f"{case['type']}Request"
    assert header["response_type"] == f"{case['type']}Response"


@pytest.mark.parametrize("case", [*SLOWER, *EVERY_STEP], ids=name)
def test_topic_has_rate_of_contract(measured: dict[str, dict[str, int]], case: dict[str, Any]) -> None:
    rate = STEPS if case["rate"] == "step" else case["rate"]
    speakers = {who: found / SECONDS for who, found in measured[case["name"]].items()}
    assert speakers
    if isinstance(rate, dict):  # in lockstep the cell also publishes the frames of robot_state_publisher
        assert set(speakers.values()) == set(rate.values())
    else:
        assert set(speakers.values()) == {rate}, speakers


def test_trays_and_frames_have_rates_of_contract(measured: dict[str, dict[str, int]]) -> None:
    """In real time robot_state_publisher publishes the arm's frames: `ros1/host/test_tf.py` checks their stamps."""
    assert len(measured["/ariac/trays"]) == 2
    assert measured["/tf"]["/gazebo logical_camera_frame"] == 10 * SECONDS
    assert measured["/tf"]["/gazebo base_link"] == 50 * SECONDS
