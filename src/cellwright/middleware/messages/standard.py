"""The standard message classes that Cellwright speaks, under their plain names.

They come from the library (ROS 2 Kilted, whose `Range` knows a variance); here they only get names that can be typed.
"""

from rosbags.typesys.stores.ros2_kilted import actionlib_msgs__msg__GoalID as GoalID
from rosbags.typesys.stores.ros2_kilted import actionlib_msgs__msg__GoalStatus as GoalStatus
from rosbags.typesys.stores.ros2_kilted import actionlib_msgs__msg__GoalStatusArray as GoalStatusArray
from rosbags.typesys.stores.ros2_kilted import builtin_interfaces__msg__Duration as Duration
from rosbags.typesys.stores.ros2_kilted import builtin_interfaces__msg__Time as Time
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__Point as Point
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__Point32 as Point32
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__Pose as Pose
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__PoseArray as PoseArray
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__PoseStamped as PoseStamped
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__Quaternion as Quaternion
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__Transform as Transform
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__TransformStamped as TransformStamped
from rosbags.typesys.stores.ros2_kilted import geometry_msgs__msg__Vector3 as Vector3
from rosbags.typesys.stores.ros2_kilted import rosgraph_msgs__msg__Clock as Clock
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__CameraInfo as CameraInfo
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__ChannelFloat32 as ChannelFloat32
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__CompressedImage as CompressedImage
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__Image as Image
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__JointState as JointState
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__LaserScan as LaserScan
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__PointCloud as PointCloud
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__PointCloud2 as PointCloud2
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__PointField as PointField
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__Range as Range
from rosbags.typesys.stores.ros2_kilted import sensor_msgs__msg__RegionOfInterest as RegionOfInterest
from rosbags.typesys.stores.ros2_kilted import std_msgs__msg__Bool as Bool
from rosbags.typesys.stores.ros2_kilted import std_msgs__msg__ColorRGBA as ColorRGBA
from rosbags.typesys.stores.ros2_kilted import std_msgs__msg__Float32 as Float32
from rosbags.typesys.stores.ros2_kilted import std_msgs__msg__Float64 as Float64
from rosbags.typesys.stores.ros2_kilted import std_msgs__msg__Header as Header
from rosbags.typesys.stores.ros2_kilted import std_msgs__msg__MultiArrayLayout as MultiArrayLayout
from rosbags.typesys.stores.ros2_kilted import std_msgs__msg__String as String
from rosbags.typesys.stores.ros2_kilted import std_msgs__msg__UInt8MultiArray as UInt8MultiArray
from rosbags.typesys.stores.ros2_kilted import tf2_msgs__msg__TFMessage as TFMessage
from rosbags.typesys.stores.ros2_kilted import trajectory_msgs__msg__JointTrajectory as JointTrajectory
from rosbags.typesys.stores.ros2_kilted import trajectory_msgs__msg__JointTrajectoryPoint as JointTrajectoryPoint
from rosbags.typesys.stores.ros2_kilted import visualization_msgs__msg__Marker as Marker
from rosbags.typesys.stores.ros2_kilted import visualization_msgs__msg__MarkerArray as MarkerArray
from rosbags.typesys.stores.ros2_kilted import visualization_msgs__msg__MeshFile as MeshFile

__all__ = [
    "Bool",
    "CameraInfo",
    "ChannelFloat32",
    "Clock",
    "ColorRGBA",
    "CompressedImage",
    "Duration",
    "Float32",
    "Float64",
    "GoalID",
    "GoalStatus",
    "GoalStatusArray",
    "Header",
    "Image",
    "JointState",
    "JointTrajectory",
    "JointTrajectoryPoint",
    "LaserScan",
    "Marker",
    "MarkerArray",
    "MeshFile",
    "MultiArrayLayout",
    "Point",
    "Point32",
    "PointCloud",
    "PointCloud2",
    "PointField",
    "Pose",
    "PoseArray",
    "PoseStamped",
    "Quaternion",
    "Range",
    "RegionOfInterest",
    "String",
    "TFMessage",
    "Time",
    "Transform",
    "TransformStamped",
    "UInt8MultiArray",
    "Vector3",
]
