"""A cell as it describes itself to a client."""

from cellwright import load_trial
from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.config.control import ControlSpace
from cellwright.config.layout.arm_models import arm_model
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import GRIPPER, RAIL, UR10
from cellwright.motion.chain import chain_of
from tests.cell.arm_cells import PEDESTAL, TWO_UR5, ur5_cell


def test_chain_of_the_ur10_goes_from_its_rail_to_its_cup() -> None:
    chains = Client.in_process(Cell(Trial("", has_arm=True))).chains()
    assert chains == {"arm": chain_of(UR10, GRIPPER)}
    assert chains["arm"].links[RAIL].joints == 0


def test_chain_of_another_arm_has_the_names_of_messages() -> None:
    trial = ur5_cell()
    client = Client.in_process(Cell(trial))
    arm = trial.arms[0]
    chain = client.chains()[arm.name]
    assert chain == chain_of(arm_model(arm, trial.arm_models[arm.name], ""), GRIPPER)
    client.sleep(0.1)
    assert {joint.name for joint in chain.joints} <= client.joint_positions.keys()
    assert client.layout() == trial.layout


def test_chains_of_several_arms_have_their_names_in_messages_and_frames() -> None:
    client = Client.in_process(Cell(ur5_cell(TWO_UR5)))
    chains = client.chains()
    assert chains["arm1"].joints[0].name == "shoulder_pan_joint"
    assert chains["arm2"].joints[0].name == "arm2_shoulder_pan_joint"
    assert chains["arm2"].base_T_tool == chains["arm1"].base_T_tool
    moving = {name for name, link in chains["arm2"].links.items() if link.joints > 0}
    assert moving & client.solids().keys() == {name for name in client.solids() if name.startswith("arm2_")}


def test_chain_without_a_cup_ends_at_the_tip() -> None:
    bare = PEDESTAL.replace("tip: tool0", "tip: wrist_2_link\n      tool: {{kind: none}}")
    chain = Client.in_process(Cell(ur5_cell(bare))).chains()["arm"]
    assert len(chain.joints) == 5
    assert chain.base_T_tool == chain.links["wrist_2_link"].pose


def test_cell_without_an_arm_has_no_chain() -> None:
    assert Client.in_process(Cell(Trial(""))).chains() == {}


def test_client_knows_what_can_be_commanded_and_the_task() -> None:
    trial = load_trial("pick_from_bin")
    client = Client.in_process(Cell(trial))
    assert client.control_space() == ControlSpace.of(trial)
    assert client.timestep() == trial.settings.timestep
    assert trial.task is not None
    assert client.sentence == trial.task.sentence
    assert Client.in_process(Cell(load_trial("lesson"))).sentence == ""
