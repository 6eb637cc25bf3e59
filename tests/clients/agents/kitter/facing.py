"""A cell in which two arms face each other."""

from cellwright.clients.agents.kitter.described_arm import DescribedArm
from cellwright.clients.client.client import Client
from cellwright.config.trial.trial import Trial
from tests.cell.arm_cells import FACING_UR5, ur5_cell

FACING = FACING_UR5
FACING += """\
  belts: {{belt: {{from: [0.6, 2.0], to: [0.6, -1.5], width: 0.3, surface: 0.45, speed: 0.12}}}}
  trays:
    far: {{at: [1.4, -0.5], size: [0.4, 0.3], surface: 0.45}}
    near: {{at: [-0.1, 0.5], size: [0.4, 0.3], surface: 0.45}}
orders: {{order_0: {{tray: near, parts: [{{type: gear_part, xy: [0, 0]}}]}}}}
"""


def facing(distance: float) -> Trial:
    """Return the trial of a cell with two UR5 that face each other, at a distance [m]."""
    return ur5_cell(FACING.replace("DISTANCE", str(distance)))


def described(client: Client) -> list[DescribedArm]:
    """Return the postures of its arms."""
    found = []
    for arm in client.layout().arms:
        device = client.arm(arm.namespace)
        client.sleep(0.1)
        chain, positions = client.chains()[arm.name], device.joint_positions
        found.append(DescribedArm(chain, arm, [positions[joint.name] for joint in chain.joints], highest=0.45))
    return found
