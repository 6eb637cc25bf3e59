"""A program in the style of 2017 works a whole trial: it sees a part, presses the cup onto it, delivers it."""

import json
import shlex
from pathlib import Path

import pytest

from tests.ros1.ground import Ground

pytest_plugins = ["tests.ros1.fixtures"]

pytestmark = pytest.mark.ros1

TRIAL = """\
options:
  insert_models_over_bins: true
models_over_bins:
  bin7:
    models:
      piston_rod_part:
        xyz_start: [0.3, 0.1, 0.0]
        xyz_end: [0.3, 0.1, 0.0]
        rpy: [0, 0, 'pi/4']
        num_models_x: 1
        num_models_y: 1
orders:
  order_0:
    announcement_condition: time
    announcement_condition_value: 0.0
    parts:
      rod:
        type: piston_rod_part
        pose:
          xyz: [0.107, 0.053, 0]
          rpy: [0, 0, 2.23]
time_limit: 300
"""

TEAM = """\
arm:
  type: ur10
sensors:
  logical_camera_1:
    type: logical_camera
    pose:
      xyz: [-0.3, 0.23, 1.35]
      rpy: [0, 'pi/2', 0]
"""

PROGRAM = """\
#!/usr/bin/env python
import copy
import json
import math

import rospy
import tf
from ariac_example import ariac_example as ariac
from osrf_gear.msg import LogicalCameraImage
from osrf_gear.srv import GetMaterialLocations
from std_msgs.msg import Float32
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

# elbow, rail, shoulder lift, shoulder pan, wrists
READY = [2.5, 0.0, -1.2, 3.20, 3.5, -1.51, 0.0]
ABOVE = [2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0]
ON_IT = [2.09, 0.25, -0.47, 3.2, 3.1, -1.51, 0.0]
BY_AGV = [2.5, 2.0, -1.0, 1.5, 3.0, -1.51, 0.0]
OVER_TRAY = [1.02, 2.0, -0.27, 1.5, 4.0, -1.51, 0.0]
RAIL = 1


class Kitting(ariac.MyCompetitionClass):
    def __init__(self):
        ariac.MyCompetitionClass.__init__(self)
        self.score = 0.0
        self.image = None
        self.states = []
        self.listener = tf.TransformListener()
        rospy.Subscriber("/ariac/current_score", Float32, self.score_callback)
        rospy.Subscriber("/ariac/logical_camera_1", LogicalCameraImage, self.image_callback)

    def score_callback(self, msg):
        self.score = msg.data

    def image_callback(self, msg):
        self.image = msg

    def comp_state_callback(self, msg):
        ariac.MyCompetitionClass.comp_state_callback(self, msg)
        if not self.states or self.states[-1] != msg.data:
            self.states.append(msg.data)

    def wait_for(self, what, seconds=60.0):
        end = rospy.Time.now() + rospy.Duration(seconds)
        rate = rospy.Rate(50)
        while not rospy.is_shutdown() and not what():
            if rospy.Time.now() > end:
                return False
            rate.sleep()
        return True

    def move(self, waypoints, times):
        msg = JointTrajectory()
        msg.joint_names = self.arm_joint_names
        for positions, seconds in zip(waypoints, times):
            point = JointTrajectoryPoint()
            point.positions = positions
            point.time_from_start = rospy.Duration(seconds)
            msg.points.append(point)
        self.joint_trajectory_publisher.publish(msg)
        rospy.sleep(times[-1] + 0.5)

    def find(self, part_type):
        self.wait_for(lambda: self.image is not None)
        assert [model.type for model in self.image.models] == [part_type], self.image
        frame = "logical_camera_1_" + part_type + "_1_frame"
        self.listener.waitForTransform("world", frame, rospy.Time(0), rospy.Duration(10.0))
        return self.listener.lookupTransform("world", frame, rospy.Time(0))[0]

    def fill(self, order):
        places = rospy.ServiceProxy("/ariac/material_locations", GetMaterialLocations)
        for kit in order.kits:
            for part in kit.objects:
                assert [unit.unit_id for unit in places(part.type).storage_units] == ["bin7"]
                rail = self.find(part.type)[1] + 0.22
                above, on_it = copy.copy(ABOVE), copy.copy(ON_IT)
                above[RAIL] = on_it[RAIL] = rail
                self.move([READY, above], [1.0, 2.0])
                ariac.control_gripper(True)
                self.move([on_it], [1.0])
                held = self.wait_for(lambda: self.current_gripper_state.attached)
                rospy.loginfo("holding it: %s", held)
                self.move([above, BY_AGV, OVER_TRAY], [1.0, 3.0, 4.0])
                ariac.control_gripper(False)
                self.wait_for(lambda: not self.current_gripper_state.attached)
                self.move([BY_AGV], [1.0])
            rospy.sleep(1.0)
            assert ariac.control_agv(1, kit.kit_type)


def main():
    rospy.init_node("kitting")
    kitting = Kitting()
    ariac.connect_callbacks(kitting)
    assert ariac.start_competition()
    kitting.wait_for(lambda: kitting.received_orders)
    kitting.fill(kitting.received_orders[0])
    kitting.wait_for(lambda: kitting.current_comp_state == "done")
    rospy.sleep(0.5)
    print("found: " + json.dumps({
        "states": kitting.states,
        "score": kitting.score,
        "orders": [order.order_id for order in kitting.received_orders],
        "time": rospy.get_time(),
    }))


if __name__ == "__main__":
    main()
"""


def test_program_of_2017_works_trial_from_start_to_score(full_master: Ground, tmp_path: Path) -> None:
    """In the format of 2017: a trial and the team's sensors in two files, competition mode."""
    for name, text in (("trial.yaml", TRIAL), ("team.yaml", TEAM), ("kitting.py", PROGRAM)):
        (tmp_path / name).write_text(text)
    (tmp_path / "kitting.py").chmod(0o755)
    full_master.serve(str(tmp_path / "trial.yaml"), str(tmp_path / "team.yaml"), "--speed", "2")
    paths = full_master.cellwright("ros1-env", "--dir", str(tmp_path / "env"))
    assert paths.finish() == 0, paths.said
    script = f"{paths.out}\nexec {shlex.quote(str(tmp_path / 'kitting.py'))}"
    program = full_master.start(["bash", "-c", script], PYTHONPATH="")
    assert program.finish() == 0, program.out + program.err + full_master.log()
    found = json.loads(program.wait_for("^found: (.*)$")[1])
    assert found["states"][-2:] in (["go", "done"], ["end_game", "done"])
    assert found["orders"] == ["order_0"]
    assert found["score"] == 3.0, full_master.log()
    assert found["time"] < 300.0, "it has ended before its limit"
    assert "Traceback" not in program.err
