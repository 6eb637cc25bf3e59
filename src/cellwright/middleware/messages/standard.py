"""Standard message classes that Cellwright uses, under their plain names.

They come from the library (ROS 2 Kilted, whose `Range` has a variance); here they get names for type annotations.
"""

from rosbags.typesys.stores import ros2_kilted

GoalID = ros2_kilted.actionlib_msgs__msg__GoalID
GoalStatus = ros2_kilted.actionlib_msgs__msg__GoalStatus
GoalStatusArray = ros2_kilted.actionlib_msgs__msg__GoalStatusArray
Duration = ros2_kilted.builtin_interfaces__msg__Duration
Time = ros2_kilted.builtin_interfaces__msg__Time
Point = ros2_kilted.geometry_msgs__msg__Point
Point32 = ros2_kilted.geometry_msgs__msg__Point32
Pose = ros2_kilted.geometry_msgs__msg__Pose
PoseArray = ros2_kilted.geometry_msgs__msg__PoseArray
PoseStamped = ros2_kilted.geometry_msgs__msg__PoseStamped
Quaternion = ros2_kilted.geometry_msgs__msg__Quaternion
Transform = ros2_kilted.geometry_msgs__msg__Transform
TransformStamped = ros2_kilted.geometry_msgs__msg__TransformStamped
Twist = ros2_kilted.geometry_msgs__msg__Twist
TwistStamped = ros2_kilted.geometry_msgs__msg__TwistStamped
Vector3 = ros2_kilted.geometry_msgs__msg__Vector3
Clock = ros2_kilted.rosgraph_msgs__msg__Clock
CameraInfo = ros2_kilted.sensor_msgs__msg__CameraInfo
ChannelFloat32 = ros2_kilted.sensor_msgs__msg__ChannelFloat32
CompressedImage = ros2_kilted.sensor_msgs__msg__CompressedImage
Image = ros2_kilted.sensor_msgs__msg__Image
JointState = ros2_kilted.sensor_msgs__msg__JointState
LaserScan = ros2_kilted.sensor_msgs__msg__LaserScan
PointCloud = ros2_kilted.sensor_msgs__msg__PointCloud
PointCloud2 = ros2_kilted.sensor_msgs__msg__PointCloud2
PointField = ros2_kilted.sensor_msgs__msg__PointField
Range = ros2_kilted.sensor_msgs__msg__Range
RegionOfInterest = ros2_kilted.sensor_msgs__msg__RegionOfInterest
Bool = ros2_kilted.std_msgs__msg__Bool
ColorRGBA = ros2_kilted.std_msgs__msg__ColorRGBA
Float32 = ros2_kilted.std_msgs__msg__Float32
Float64 = ros2_kilted.std_msgs__msg__Float64
Header = ros2_kilted.std_msgs__msg__Header
MultiArrayLayout = ros2_kilted.std_msgs__msg__MultiArrayLayout
String = ros2_kilted.std_msgs__msg__String
UInt8MultiArray = ros2_kilted.std_msgs__msg__UInt8MultiArray
TFMessage = ros2_kilted.tf2_msgs__msg__TFMessage
JointTrajectory = ros2_kilted.trajectory_msgs__msg__JointTrajectory
JointTrajectoryPoint = ros2_kilted.trajectory_msgs__msg__JointTrajectoryPoint
Marker = ros2_kilted.visualization_msgs__msg__Marker
MarkerArray = ros2_kilted.visualization_msgs__msg__MarkerArray
MeshFile = ros2_kilted.visualization_msgs__msg__MeshFile
