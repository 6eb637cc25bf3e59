"""Resolved values of the public trials, against the figures of the competition's own launcher."""

import json
from typing import Any

import pytest
import yaml

from cellwright.config.trial.gear2017 import load_trial, resolved, resolved_cell
from tests.conftest import DATA

TRIALS: dict[str, Any] = json.loads((DATA / "gear2017_trials.json").read_text())["trials"]


def test_reference_data_has_28_trials() -> None:
    assert len(TRIALS) == 28


@pytest.mark.slow
@pytest.mark.parametrize("name", TRIALS)
def test_resolved_trial_equals_original_launcher(name: str) -> None:
    loaded = load_trial(text=yaml.safe_dump(TRIALS[name]["config"], sort_keys=False))
    assert json.loads(json.dumps(resolved(loaded))) == TRIALS[name]["resolved"]


@pytest.mark.slow
@pytest.mark.parametrize("name", TRIALS)
def test_trial_values_equal_original_launcher(name: str) -> None:
    expected = TRIALS[name]["resolved"]
    trial = load_trial(text=yaml.safe_dump(TRIALS[name]["config"], sort_keys=False)).trial
    limit = expected["time_limit"]
    assert trial.time_limit == (None if limit < 0 else limit)
    poses = {part.name: part.pose.position for part in trial.bin_parts}
    assert poses.keys() == {model[0] for model in expected["models"]}
    for model, _, xyz, _ in expected["models"]:
        assert poses[model] == pytest.approx(xyz, abs=1e-10)
    assert [[part.time, part.type] for part in trial.belt_parts] == [part[:2] for part in expected["belt"]]
    assert trial.faulty_parts == set(expected["faulty"])
    assert {t: list(places) for t, places in trial.material_locations.items()} == expected["material_locations"]
    assert [[kit.kit_type for kit in order.kits] for order in trial.orders] == [
        [kit["kit_type"] for kit in order["kits"]] for order in expected["orders"]
    ]


def test_resolved_orders_are_sorted_by_announcement() -> None:
    part = "{type: gear_part, pose: {}}"
    text = f"""
orders:
  order_0: {{announcement_condition: wanted_parts, announcement_condition_value: 1, parts: {{a: {part}}}}}
  order_1: {{announcement_condition: time, announcement_condition_value: 20, parts: {{a: {part}}}}}
"""
    orders = resolved(load_trial(text=text))["orders"]
    assert [order["order_id"] for order in orders] == ["order_1", "order_0"]
    assert orders[0]["kits"][0]["objects"][0]["pose"] == {"xyz": ["0", "0", "0"], "rpy": ["0", "0", "0"]}


def test_resolved_extra_models_are_listed() -> None:
    text = """
options: {spawn_extra_models: true}
models_to_spawn: {world: {models: {a: {type: part2, pose: {xyz: [1, 2, 3]}}}}}
"""
    data = resolved(load_trial(text=text))
    assert data["extra_models"] == [["world|part2_1", "part2", "world", [1.0, 2.0, 3.0], [0.0, 0.0, 0.0]]]


def test_resolved_cell_lists_sensors_arm_and_settings() -> None:
    text = """
sensors: {beam: {type: break_beam, pose: {xyz: [1.6, 2.25, 0.91], rpy: [0, 0, pi]}}}
arm: {type: ur10}
cellwright:
  seed: 7
  timestep: 1/1000
  arm: {servo: precise, initial_joint_states: {elbow_joint: 1.5}}
  sensors: {over: {type: rgb_camera, pose: {xyz: [0, 0, 2]}, width: 64}}
"""
    found = resolved_cell(load_trial(text=text).trial)
    assert json.loads(json.dumps(found)) == found
    beam, over = found["sensors"]
    assert beam == {"name": "beam", "type": "break_beam", "xyz": [1.6, 2.25, 0.91], "rpy": [0.0, 0.0, 3.14159265359]}
    assert (over["type"], over["frame"], over["width"], over["xyz"]) == ("rgb_camera", "world", 64, [0.0, 0.0, 2.0])
    assert (found["arm"]["servo"], found["arm"]["initial_joint_states"]) == ("precise", {"elbow_joint": 1.5})
    assert (found["seed"], found["timestep"], found["options"]["insert_agvs"]) == (7, 0.001, True)
    assert resolved_cell(load_trial(text="").trial)["arm"] is None
