"""Packs the parts of an order with a parallel gripper: `cellwright run cell.yaml --agent packer.py:Packer`."""

import math

from cellwright import Client, Pose
from cellwright.mechanism.solvers import solver_of
from cellwright.middleware.messages.conversions import pose_from_message

GRASP, RELEASE, ABOVE = 0.025, 0.035, 0.15
"""Heights of the middle between the pads [m]: over a part's origin, over its place in the tray, and on the way."""


class Packer:
    """Takes the first part of the right type from the bin, as often as the order asks for."""

    def run(self, client: Client) -> None:
        """Fill the first order, and submit it."""
        client.start_competition()
        order = client.wait_for_order(5.0)
        client.joint_states.wait(1.0)
        (arm,), (tray,) = client.layout().arms, client.layout().trays
        chain = client.chains()[arm.name]
        self.client, self.arm = client, arm
        self.solver = solver_of(chain, [client.joint_positions[joint.name] for joint in chain.joints])
        for kit in order.kits if order is not None else ():
            for wanted in kit.objects:
                self.carry(self.find(client, wanted.type), tray.tray_frame @ pose_from_message(wanted.pose))
            client.control_agv(tray.name, kit.kit_type)
        client.wait_until(lambda: client.competition_state == "done", 5.0)

    def find(self, client: Client, kind: str) -> Pose:
        """Return the pose of the first part of a type that the camera sees, in the world."""
        image = client.sensor("logical_camera_bin1").wait_for_next(1.0)
        found = next(each for each in image.models if each.type == kind)
        return pose_from_message(image.pose) @ pose_from_message(found.pose)

    def carry(self, part: Pose, goal: Pose) -> None:
        """Take a part, and put it down at a goal."""
        for place, height, is_taken in ((part, GRASP, True), (goal, RELEASE, False)):
            self.move(place, ABOVE, 2.0)
            self.move(place, height, 1.0)
            self.grip(is_taken)
            self.move(place, ABOVE, 1.0)

    def grip(self, is_taken: bool) -> None:  # noqa: FBT001
        """Close on a part, or let go of it."""
        self.client.control_gripper(is_taken)
        self.client.wait_until(lambda: self.client.gripper_attached == is_taken, 2.0)
        self.client.sleep(0.3)

    def move(self, part: Pose, height: float, duration: float) -> None:
        """Move the gripper over a part, pointing down, with the pads along two of its sides."""
        x, y, z = part.position
        grasp = Pose.from_rpy((x, y, z + height), (math.pi, 0.0, part.yaw))
        tip = self.arm.pose.inverse() @ grasp @ Pose((0.0, 0.0, -self.arm.tool.length))
        near = [self.client.joint_positions[name] for name in self.solver.joints]
        posture = next(iter(self.solver.branches(tip, near)))
        still = [0.0] * len(posture)
        self.client.send_arm([near, posture], [0.1, duration], velocities=[still, still], joints=self.solver.joints)
        self.client.sleep(duration + 0.2)
