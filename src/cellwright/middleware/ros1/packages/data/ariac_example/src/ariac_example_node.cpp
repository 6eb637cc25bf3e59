// Starts the competition, moves the arm to its zero position, and listens to what the cell says.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <osrf_gear/LogicalCameraImage.h>
#include <osrf_gear/Order.h>
#include <osrf_gear/Proximity.h>
#include <osrf_gear/VacuumGripperState.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/Range.h>
#include <std_msgs/String.h>
#include <std_srvs/Trigger.h>
#include <trajectory_msgs/JointTrajectory.h>

namespace
{
const double kPrintPeriod = 10.0;  // [s] between two lines about a topic that never stops
const double kReachTime = 0.001;   // [s] as good as at once

/// Wait for the service that starts the competition, and call it.
bool startCompetition(ros::NodeHandle & node)
{
  ros::ServiceClient client = node.serviceClient<std_srvs::Trigger>("/ariac/start_competition");
  client.waitForExistence();
  std_srvs::Trigger call;
  if (!client.call(call))
  {
    ROS_ERROR("the call to start the competition failed");
    return false;
  }
  if (!call.response.success)
  {
    ROS_ERROR_STREAM("the competition did not start: " << call.response.message);
    return false;
  }
  ROS_INFO("the competition has started");
  return true;
}
}  // namespace

/// Keeps what the cell last said, and moves the arm.
class MyCompetitionClass
{
public:
  explicit MyCompetitionClass(ros::NodeHandle & node)
  : trajectory_publisher_(node.advertise<trajectory_msgs::JointTrajectory>("/ariac/arm/command", 10))
  {
  }

  void stateCallback(const std_msgs::String::ConstPtr & message)
  {
    if (message->data != competition_state_)
    {
      ROS_INFO_STREAM("competition state: " << message->data);
    }
    competition_state_ = message->data;
  }

  void orderCallback(const osrf_gear::Order::ConstPtr & message)
  {
    ROS_INFO_STREAM("order received:\n" << *message);
    orders_.push_back(*message);
  }

  /// Once the joints are heard of and the arm hears, it goes to its zero position.
  void jointStateCallback(const sensor_msgs::JointState::ConstPtr & message)
  {
    ROS_INFO_STREAM_THROTTLE(kPrintPeriod, "joint states:\n" << *message);
    joint_state_ = *message;
    if (!has_been_zeroed_ && trajectory_publisher_.getNumSubscribers() > 0)
    {
      has_been_zeroed_ = true;
      sendArmToZero();
    }
  }

  void gripperStateCallback(const osrf_gear::VacuumGripperState::ConstPtr & message)
  {
    ROS_INFO_STREAM_THROTTLE(kPrintPeriod, "gripper state:\n" << *message);
  }

  void beamCallback(const osrf_gear::Proximity::ConstPtr & message)
  {
    if (message->object_detected)
    {
      ROS_INFO("the break beam is broken");
    }
  }

  void proximityCallback(const sensor_msgs::Range::ConstPtr & message)
  {
    if (message->range < message->max_range)
    {
      ROS_INFO_THROTTLE(1, "something is %g m before the proximity sensor", message->range);
    }
  }

  void cameraCallback(const osrf_gear::LogicalCameraImage::ConstPtr & message)
  {
    ROS_INFO_STREAM_THROTTLE(kPrintPeriod, "the camera sees " << message->models.size() << " models");
  }

  void profilerCallback(const sensor_msgs::LaserScan::ConstPtr & message)
  {
    const long hits = std::count_if(
      message->ranges.begin(), message->ranges.end(), [](float range) { return std::isfinite(range); });
    if (hits > 0)
    {
      ROS_INFO_THROTTLE(1, "the profiler's light falls on something in %ld directions", hits);
    }
  }

private:
  void sendArmToZero()
  {
    trajectory_msgs::JointTrajectory command;
    command.joint_names = {
      "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint",
      "wrist_2_joint", "wrist_3_joint", "linear_arm_actuator_joint"};
    command.points.resize(1);
    command.points[0].positions.assign(command.joint_names.size(), 0.0);
    command.points[0].time_from_start = ros::Duration(kReachTime);
    ROS_INFO("sending the arm to its zero position");
    trajectory_publisher_.publish(command);
  }

  ros::Publisher trajectory_publisher_;
  std::string competition_state_;
  std::vector<osrf_gear::Order> orders_;
  sensor_msgs::JointState joint_state_;
  bool has_been_zeroed_ = false;
};

int main(int argc, char ** argv)
{
  ros::init(argc, argv, "ariac_example_node");
  ros::NodeHandle node;
  MyCompetitionClass competition(node);

  using Class = MyCompetitionClass;
  const std::vector<ros::Subscriber> subscribers = {
    node.subscribe("/ariac/competition_state", 10, &Class::stateCallback, &competition),
    node.subscribe("/ariac/orders", 10, &Class::orderCallback, &competition),
    node.subscribe("/ariac/joint_states", 10, &Class::jointStateCallback, &competition),
    node.subscribe("/ariac/gripper/state", 10, &Class::gripperStateCallback, &competition),
    node.subscribe("/ariac/proximity_sensor_1", 10, &Class::proximityCallback, &competition),
    node.subscribe("/ariac/break_beam_1_change", 10, &Class::beamCallback, &competition),
    node.subscribe("/ariac/logical_camera_1", 10, &Class::cameraCallback, &competition),
    node.subscribe("/ariac/laser_profiler_1", 10, &Class::profilerCallback, &competition),
  };

  startCompetition(node);
  ros::spin();
  return 0;
}
