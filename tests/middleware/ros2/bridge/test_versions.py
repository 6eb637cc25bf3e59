"""Versions of the standard's packages: definitions hash by hash as released, and answers in each version.

`ros2_releases.json` has what was released, and is never written by a test.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cellwright._package import FOLDER
from cellwright.middleware.ros2.packages.contents import definitions
from cellwright.viewer.services.simulation_requests import FAILED, INCORRECT_STATE, INVALID_POSE, OK
from tests.middleware.ros2.packages.test_interfaces import loaded, run
from tests.ros2.requirement import installation_of
from tests.viewer.services.simulated import GEAR, IN_BIN7, Services

RELEASES: dict[str, dict[str, dict[str, Any]]] = json.loads(
    (Path(__file__).parents[3] / "data" / "ros2_releases.json").read_text(encoding="utf-8")
)
"""Hash, constants and defaults of definitions, and texts that differ from ours, by package, version and name."""

STANDARD = "simulation_interfaces"
OURS, OLDEST, NEWEST = "1.5.1", "1.0.0", "2.1.0"

ANSWERED = """
import importlib, json, sys
from pathlib import Path

from ament_index_python.packages import get_package_prefix

folder, place, versions, given = Path(sys.argv[1]), sys.argv[2], *map(json.loads, sys.argv[3:])
prefix = Path(get_package_prefix("geometry_msgs"))
sys.path[:0] = [place, f"{place}/cellwright/middleware/ros2/packages"]
import generate
from cellwright.middleware.ros2.bridge import standard_services as bridge
from cellwright.middleware.ros2.bridge.interfaces import fill, values_of
from cellwright.middleware.wire.frames import Frame, FrameKind

PACKAGE = "simulation_interfaces"
described = {path.name: path for path in (prefix / "share").iterdir()}
generate._keep_what_was_read()
found = {}

class Node:
    def __init__(self):
        self.receiver, self.served = self, {}

    def serve(self, kind, name, serve, **_):
        self.served[kind.__name__] = kind, serve

class Calls:
    def before_answer(self):
        pass

    def ask(self, name, type_name, payload, heard):
        self.asked = json.loads(payload)
        answer = given["answers"].get(name.partition("/")[2], {"result": {"result": 1, "error_message": ""}})
        heard(Frame(FrameKind.ANSWER, payload=json.dumps(answer).encode()))

for version in versions:
    work = folder / version
    generated = work / "gen" / PACKAGE
    arguments = generate.describe(PACKAGE, work, prefix, described | {PACKAGE: generated})
    generate.generate_py(arguments("rosidl_generator_py"), ["rosidl_typesupport_c"])
    (generated / "__init__.py").touch()
    for name in [each for each in sys.modules if each.partition(".")[0] == PACKAGE]:
        del sys.modules[name]
    sys.path.insert(0, str(work / "gen"))
    importlib.invalidate_caches()
    node, calls, answered = Node(), Calls(), {}
    bridge.ServerServices(node, calls, PACKAGE, bridge.SIMULATION, bridge.SERVICES, bridge._failed)
    for name, (kind, serve) in node.served.items():
        request = fill(kind.Request(), given["requests"].get(name, {}))
        serve(request, lambda response: answered.update({name: [calls.asked, values_of(response)]}))
    hashes = {}
    for path in generated.glob("*/*.json"):
        for each in json.loads(path.read_text())["type_hashes"]:
            hashes[each["type_name"]] = each["hash_string"]
    found[version] = {"offered": bridge.SERVICES, "answered": answered, "hashes": hashes}
print("found: " + json.dumps(found))
"""
"""Program that makes versions of the package, and answers requests with the bridge's services in each."""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Findings of the program in the oldest and in the newest version."""
    folder = tmp_path_factory.mktemp("versions")
    for version in (OLDEST, NEWEST):
        ours = {path.partition(".")[0]: path for path in definitions()[STANDARD]}
        for name, each in RELEASES[STANDARD][version].items():
            path = folder / version / "src" / STANDARD / ours[name]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(each.get("text", definitions()[STANDARD][ours[name]]))
    services = Services()
    part, world = {"uri": "gear_part"}, {"uri": "final01"}
    given = {
        "answers": {
            "GetSimulatorFeatures": {"features": {"features": [0, 14, 40, 45, 50], "spawn_formats": []}},
            "GetSimulationState": {"state": {"state": 5}, "result": {"result": OK, "error_message": ""}},
            "GetSpawnables": services("GetSpawnables"),
            "SetEntityState": {"result": {"result": INVALID_POSE, "error_message": "bad pose"}},
        },
        "requests": {
            "LoadWorld": {**world, "world_resource": world},
            "SetEntityState": {"entity": GEAR, "state": {"pose": IN_BIN7}, "set_twist": True},
            "SpawnEntity": {**part, "entity_resource": part, "initial_pose": {"pose": IN_BIN7}},
        },
    }
    arguments = [str(folder), str(Path(FOLDER).parent), json.dumps([OLDEST, NEWEST]), json.dumps(given)]
    out = run(ANSWERED, *arguments, under=installation_of("jazzy"))
    return json.loads(out.rpartition("found: ")[2])


@pytest.mark.slow
def test_each_definition_has_the_hash_and_the_constants_of_its_release(built: Any) -> None:
    rows: list[tuple[str, str, Any, Any]] = []
    for distribution in ("jazzy", "kilted"):
        hashes, constants = loaded(distribution)
        for package, versions in RELEASES.items():
            for name, each in versions[OURS if package == STANDARD else distribution].items():
                full = f"{package}/{name}"
                rows.append((distribution, full, each["hash"], hashes.get(full)))
                rows.append((distribution, full, each.get("constants", {}), constants.get(full)))
            recorded = {f"{package}/{name}" for name in versions[OURS if package == STANDARD else distribution]}
            assert {full for full in constants if full.partition("/")[0] == package} == recorded
    for version in (OLDEST, NEWEST):
        for name, each in RELEASES[STANDARD][version].items():
            full = f"{STANDARD}/{name}"
            rows.append((f"{STANDARD} {version}", full, each["hash"], built[version]["hashes"].get(full)))
    for place, name, released, ours in rows:
        if isinstance(released, str):
            print(place, name, released[:15], str(ours)[:15], "equal" if ours == released else "DIFFERENT")
    assert [row for row in rows if row[2] != row[3]] == []
    assert sum(isinstance(row[2], str) for row in rows) == 2 * (38 + 17 + 9 + 4) + 29 + 38


@pytest.mark.slow
@pytest.mark.parametrize("version", [OLDEST, NEWEST])
def test_services_that_a_version_lacks_are_not_offered(built: Any, version: str) -> None:
    there = {name.partition("/")[2] for name in RELEASES[STANDARD][version] if name.startswith("srv/")}
    assert set(built[version]["answered"]) == {*built[version]["offered"]} & there
    assert ("LoadWorld" in built[version]["answered"]) == (version == NEWEST)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("version", "features", "code", "state"),
    [(OLDEST, [0, 14], FAILED, [0, INCORRECT_STATE]), (NEWEST, [0, 14, 40, 45, 50], INVALID_POSE, [5, OK])],
)
def test_numbers_that_a_version_lacks_are_not_sent(
    built: Any, version: str, features: list[int], code: int, state: list[int]
) -> None:
    answered = {name: answer for name, (_, answer) in built[version]["answered"].items()}
    assert answered["GetSimulatorFeatures"]["features"]["features"] == features
    assert answered["SetEntityState"]["result"] == {"result": code, "error_message": "bad pose"}
    of_state = answered["GetSimulationState"]
    assert [of_state["state"]["state"], of_state["result"]["result"]] == state


@pytest.mark.slow
@pytest.mark.parametrize("version", [OLDEST, NEWEST])
def test_requests_of_each_version_work_the_cell(built: Any, version: str) -> None:
    services = Services(can_load=True)
    asked = {name: request for name, (request, _) in built[version]["answered"].items()}
    (spawnable,) = built[version]["answered"]["GetSpawnables"][1]["spawnables"]
    resource = {"uri": "gear_part", "resource_string": ""}
    if version == OLDEST:
        assert (spawnable["uri"], asked["SpawnEntity"]["uri"]) == ("gear_part", "gear_part")
        assert "entity_resource" not in {**spawnable, **asked["SpawnEntity"]}
    else:
        assert spawnable["entity_resource"] == asked["SpawnEntity"]["entity_resource"] == resource
        assert services.code("LoadWorld", **asked["LoadWorld"]) == (OK, "")
        services = Services()
    assert asked["StepSimulation"] == {"steps": 1}
    assert services.code("SpawnEntity", **asked["SpawnEntity"]) == (OK, "")
    before = services("GetEntityState", entity=GEAR)["state"]["pose"]
    assert services.code("SetEntityState", **asked["SetEntityState"])[0] == OK
    after = services("GetEntityState", entity=GEAR)["state"]["pose"]
    assert (after == before) == (version == NEWEST)  # its request says that the twist alone is set
