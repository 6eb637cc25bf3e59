"""A humanoid sorts a bin into two trays; run it by `cellwright run humanoid.yaml --agent humanoid.py:Sorter`."""

import math

from cellwright import Pose
from cellwright.middleware.messages.conversions import header, joint_state, pose_from_message, pose_message
from cellwright.middleware.messages.standard import PoseArray

BASE = Pose((0.0, 0.0, 1.16))
"""The robot's base in the world; its hands go to poses in this frame."""
HANDS = {"right": 0, "left": 1}
LOW, HIGH = 0.06, 0.18
"""Heights of a hand over a part [m]: to take it or put it down, and to carry it."""


class Sorter:
    """Takes each ordered part out of the bin with the hand of the tray's side, and puts it down in the tray."""

    def run(self, client):
        self.client, self.status = client, [0.0, 0.0]
        self.tips = client.latest("/io_teleop/state_ee_poses")
        client.start_competition()
        order = client.wait_for_order()
        client.wait_until(lambda: self.tips.message is not None)
        self.home = [pose_from_message(tip) for tip in self.tips.message.poses]
        image = client.sensor("logical_camera_bin1").wait_for_next()
        camera = pose_from_message(image.pose)
        seen = [(model.type, camera @ pose_from_message(model.pose)) for model in image.models]
        for kit, tray in zip(order.kits, client.layout().trays):
            for part in kit.objects:
                where = next(each for each in seen if each[0] == part.type)
                seen.remove(where)
                goal = tray.tray_surface @ pose_from_message(part.pose)
                self.carry(HANDS[tray.name], where[1].position, goal.position)
            client.control_agv(tray.name, kit.kit_type)
        client.wait_until(lambda: client.competition_state == "done", timeout=10.0)

    def carry(self, hand, start, goal):
        for place, status in ((start, 1.0), (goal, 0.0)):
            self.move(hand, place, HIGH)
            self.move(hand, place, LOW)
            self.status[hand] = status
            self.client.publish("/io_teleop/target_gripper_status", joint_state(["", ""], self.status, time=0))
            self.client.sleep(0.3)
            self.move(hand, place, HIGH)
        self.move(hand, BASE.transform(self.home[hand].position), 0.0)

    def move(self, hand, place, above):
        """Bring a hand above a place of the world [m], turned as at home."""
        x, y, z = BASE.inverse().transform(place)
        poses = list(self.home)
        poses[hand] = Pose((x, y, z + above), self.home[hand].quaternion)
        self.client.publish("/io_teleop/target_ee_poses", PoseArray(header(), [pose_message(each) for each in poses]))

        def is_there():
            tip = pose_from_message(self.tips.message.poses[hand])
            return math.dist(tip.position, poses[hand].position) < 0.002

        self.client.wait_until(is_there, timeout=3.0)
