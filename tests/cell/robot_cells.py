"""Cells with a robot that is driven over its own topics, for tests."""

from pathlib import Path

from cellwright import Cell, load_trial
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial as load_text
from cellwright.config.trial.trial import Trial
from tests.cell.arm_cells import ARMS

ASIDE = "cell: {based_on: gear2017, robots: {qinglong: {model: qinglong, at: [-2.2, 0.0, 1.16]}}}"
"""A humanoid that stands beside the cell of 2017."""
AT_BIN = """
cell:
  robots:
    tandem: {model: tandem, at: [0.0, 0.0, 0.0], namespace: left}
  bins: {bin1: {at: [0.8, 0.0], size: [0.4, 0.4], surface: 0.5}}
parts: [{type: gear_part, in: bin1, grid: [2, 2]}]
"""
"""A small robot before a bin, in a namespace of its own."""


def final01(folder: Path, more: str = "") -> Cell:
    """Return the cell of the first final, with further entries."""
    files = [find_trial("final01"), find_trial("kitter_sensors")]
    if more:
        (folder / "more.yaml").write_text(more)
        files.append(folder / "more.yaml")
    return Cell(load_trial(*files))


def tandem_cell(text: str = AT_BIN) -> Trial:
    """Return the trial of a cell with a small robot."""
    return load_text(text=text).trial


ON_BACK = """
cell:
  robots:
    qinglong: {{model: qinglong, at: [0, 0, 1.16]}}
  arms:
    arm:
      model: {model}
      mount: {{kind: link, robot: qinglong, link: Link_waist_yaw, at: [-0.35, 0, 0.3], turn: pi}}
      tip: tool0
      home: {{shoulder_lift_joint: -1.2, elbow_joint: 1.6, wrist_1_joint: -2.0, wrist_2_joint: -1.57}}
  bins: {{bin1: {{at: [2, 2]}}}}
"""
"""A humanoid with a UR5 on its back."""


def arm_on_robot() -> Trial:
    """Return the trial of a cell with an arm on a humanoid."""
    return load_text(text=ON_BACK.format(model=ARMS / "ur5.urdf")).trial


BESIDE_ARM = """
cell:
  arms:
    arm: {mount: {kind: rail, at: [0.3, 0]}}
  robots:
    tandem: {model: tandem, at: [-0.3, 1.15, 0.5], namespace: left}
  bins: {bin1: {at: [-0.3, -0.5]}}
parts: [{type: gear_part, in: bin1, grid: [2, 2]}]
"""
"""A small robot in the way of an arm along its rail."""
