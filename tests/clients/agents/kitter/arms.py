"""Cells with arms of other models, in which the kitter has a bin, a belt and a tray."""

from cellwright.clients.agents.kitter.described_arm import DescribedArm
from cellwright.config.layout.arm_models import arm_model, home_of, joints_of
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.config.ur10 import GRIPPER
from cellwright.motion.chain import chain_of
from tests.cell.arm_cells import ARMS

PEDESTAL = "{kind: pedestal, at: [0, 0, 0.5]}"
RAIL = "{kind: rail, at: [0, 0, 0.5], axis: x, range: [-0.4, 0.1]}"
HOMES = {
    "ur5": "tip: tool0, home: {shoulder_lift_joint: -1.2, elbow_joint: 1.6, wrist_1_joint: -2.0, wrist_2_joint: -1.57}",
    "xarm7": "tip: link7, home: {joint2: -0.3, joint4: 1.2, joint6: 1.5}",
}

CELL = """
cell:
  arms:
    arm: {{model: {model}, mount: {mount}, {home}}}
  belts:
    belt: {{from: [0.6, 2.0], to: [0.6, -1.5], width: 0.4, surface: 0.45, speed: 0.12}}
  bins:
    bin1: {{at: [-0.1, 0.55], size: [0.5, 0.4], surface: 0.45}}
  trays:
    tray1: {{at: [-0.1, -0.55], size: [0.5, 0.4], surface: 0.45}}
  sensors:
    logical_camera_bin1: {{type: logical_camera, over: bin1, height: 0.74}}
    logical_camera_tray1: {{type: logical_camera, over: tray1, height: 0.7}}
    logical_camera_belt: {{type: logical_camera, over: belt, along: 1.2, height: 0.74}}
parts:
  - {{type: gear_part, in: bin1, grid: [3, 2]}}
  - {{type: disk_part, on: belt, every: 12, after: 3}}
orders:
  order_0:
    tray: tray1
    parts:
      - {{type: gear_part, xy: [0.12, 0.08]}}
      - {{type: disk_part, xy: [0, -0.08], yaw: pi/2}}
"""


def kitting(model: str, mount: str = PEDESTAL) -> Trial:
    """Return the trial of a cell in which an arm can win 6 points: `ur5` or `xarm7`."""
    return load_trial(text=CELL.format(model=ARMS / f"{model}.urdf", mount=mount, home=HOMES[model])).trial


def described(trial: Trial) -> DescribedArm:
    """Return the postures of a cell's arm."""
    arm = trial.arms[0]
    chain = chain_of(arm_model(arm, trial.arm_models[arm.name], ""), GRIPPER)
    home = [*home_of(arm, joints_of(arm, trial.arm_models)).values()]
    return DescribedArm(chain, arm, home, highest=0.45)
