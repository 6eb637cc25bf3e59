"""Cells with an arm of another model than that of 2017, for tests."""

from pathlib import Path

from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from tests.config.robot.mjcf_robots import menagerie

ARMS = Path(__file__).parents[1] / "data" / "arms"

_UR5 = """\
      model: {model}
      mount: {{kind: pedestal, at: [0, 0, 0.5]}}
      tip: tool0
      home: {{shoulder_lift_joint: -1.2, elbow_joint: 1.6, wrist_1_joint: -2.0, wrist_2_joint: -1.57}}
"""
"""Entry of a UR5 on a pedestal."""

PEDESTAL = f"""
cell:
  arms:
    arm:
{_UR5}"""
PEDESTAL += """\
  bins: {{bin1: {{at: [-0.1, 0.55], size: [0.5, 0.4], surface: 0.45}}}}
  trays: {{tray1: {{at: [-0.1, -0.55], size: [0.5, 0.4], surface: 0.45}}}}
parts: [{{type: gear_part, in: bin1, grid: [3, 2]}}]
orders: {{order_0: {{tray: tray1, parts: [{{type: gear_part, xy: [0.05, 0.03]}}]}}}}
"""
"""A UR5 on a pedestal between a bin and a tray."""

SPEEDS = ", ".join(
    f"{name}_joint: {{velocity: 3.1}}"
    for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
)

TWO_ON_A_RAIL = (ARMS.parent / "two_arms.yaml").read_text()
"""Two arms of 2017 on one rail, with a bin before each."""

FACING_UR5 = f"""
cell:
  arms:
    arm1: &ur5
{_UR5}    arm2: {{{{<<: *ur5, mount: {{{{kind: pedestal, at: [DISTANCE, 0, 0.5], turn: pi}}}}, names: prefixed}}}}
"""
"""Two UR5 that face each other, without anything else."""

TWO_UR5 = FACING_UR5.replace("DISTANCE", "1.1")
TWO_UR5 += """\
  bins: {{bin1: {{at: [0.55, 0], size: [0.4, 0.3], surface: 0.45}}}}
parts: [{{type: board_part, in: bin1, grid: [1, 1]}}]
cellwright: {{parts: {{board_part: {{mass: 0.2, shapes: [{{box: [0.3, 0.1, 0.02], pose: {{xyz: [0, 0, 0.01]}}}}]}}}}}}
"""
"""Two UR5 that face each other, and a bin with a board that both reach."""


CARRIED = """
cell:
  arms:
    gantry: &ur5
      model: {model}
      mount: {{kind: rail, at: [0, 0, {height}], range: [-1, 1]}}
      tip: tool0
      tool: {{kind: none}}
      home: {{shoulder_lift_joint: -1.2, elbow_joint: 1.6, wrist_1_joint: -2.0, wrist_2_joint: -1.57}}
      names: prefixed
    small: {{<<: *ur5, mount: {{kind: link, arm: gantry, link: {link}, at: {at}, turn: 0.5}}, tool: {{kind: vacuum}}}}
  bins: {{bin1: {{at: [0.4, 0.5], size: [0.5, 0.4], surface: 0.45}}}}
parts: [{{type: gear_part, in: bin1, grid: [1, 1]}}]
"""
"""A UR5 on a link of another UR5, which is on a rail, and a bin with a part."""


def carried_cell(link: str = "carriage", at: str = "[0, -0.6, 0]", height: float = 0.5, more: str = "") -> Trial:
    """Return the trial of a cell with an arm on a link of another arm.

    Args:
        link: the link.
        at: place on it [m].
        height: height of the rail [m].
        more: lines of the section `cell`.
    """
    text = CARRIED.format(model=ARMS / "ur5.urdf", link=link, at=at, height=height)
    return load_trial(text=text.replace("cell:\n", f"cell:\n{more}")).trial


def ur5_cell(text: str = PEDESTAL) -> Trial:
    """Return the trial of a cell with a UR5."""
    return load_trial(text=text.format(model=ARMS / "ur5.urdf")).trial


def ur5e_cell(entries: str) -> Trial:
    """Return the trial of a cell with the UR5e of the MuJoCo Menagerie, with further entries of the arm."""
    arm = f"model: {menagerie('universal_robots_ur5e/ur5e.xml')}, mount: {{kind: pedestal, at: [0, 0, 0.5]}}"
    home = "home: {shoulder_lift_joint: -1.2, elbow_joint: 1.6, wrist_1_joint: -2.0, wrist_2_joint: -1.57}"
    text = f"cell: {{arms: {{arm: {{{arm}, tip: attachment_site, limits: {{{SPEEDS}}}, {home}, {entries}}}}}}}"
    return load_trial(text=text).trial


FINGERS = f"""
cell:
  arms:
    arm:
{_UR5}"""
FINGERS += """\
      tool: {tool}
  bins: {{bin1: {{at: [0, 0.6], size: [0.5, 0.4], surface: 0.45}}}}
  trays: {{tray1: {{at: [0, -0.6], size: [0.5, 0.4], surface: 0.45}}}}
parts: [{{type: cube, in: bin1, grid: [2, 1]}}]
orders: {{order_0: {{tray: tray1, parts: [{{type: cube, xy: [0.0, 0.05]}}]}}}}
cellwright: {{parts: {{cube: {{mass: {mass}, shapes: [{{box: [0.04, 0.04, 0.04], pose: {{xyz: [0, 0, 0.02]}}}}]}}}}}}
"""
"""A UR5 with a parallel gripper between a bin with two cubes and a tray."""


def finger_cell(tool: str = "{kind: parallel}", mass: float = 0.5) -> Trial:
    """Return the trial of a cell with a UR5 that has a parallel gripper, and cubes of a mass [kg]."""
    return load_trial(text=FINGERS.format(model=ARMS / "ur5.urdf", tool=tool, mass=mass)).trial
