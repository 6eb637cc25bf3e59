"""Description of a robot for ros2_control, which drives it over the topics of its node, without a plugin of ours."""

from xml.etree.ElementTree import Element, SubElement, indent, tostring

from cellwright.config.robot.config import RobotConfig

PLUGIN = "joint_state_topic_hardware_interface/JointStateTopicSystem"
"""Hardware component of ros2_control that publishes commands and hears states as sensor_msgs/JointState."""

COMMANDS, STATES = "/io_teleop/joint_cmd", "/io_teleop/joint_states"
_XACRO = "http://www.ros.org/wiki/xacro"


def ros2_control_xacro(config: RobotConfig) -> str:
    """Return a xacro file with a macro `ros2_control`, for the robot's own xacro to include and call.

    Its parameters are the topics of commands and states. Every joint that is commanded has a position command; its
    initial value is that of the home posture. Joints that mimic another have states alone.

    Example:
        >>> import cellwright
        >>> text = ros2_control_xacro(cellwright.load_robot("tandem"))
        >>> PLUGIN in text
        True
    """
    name = "_".join(config.name.split())  # xacro separates parameters by spaces
    robot = Element("robot", {"xmlns:xacro": _XACRO})
    macro = SubElement(
        robot, "xacro:macro", name="ros2_control", params=f"name:={name} commands:={COMMANDS} states:={STATES}"
    )
    system = SubElement(macro, "ros2_control", name="${name}", type="system")
    hardware = SubElement(system, "hardware")
    SubElement(hardware, "plugin").text = PLUGIN
    for parameter, value in (("joint_commands_topic", "${commands}"), ("joint_states_topic", "${states}")):
        SubElement(hardware, "param", name=parameter).text = value
    home = config.home
    for joint in config.robot.driven:
        described = SubElement(system, "joint", name=joint.name)
        if joint.mimic is None:
            SubElement(described, "command_interface", name="position")
        position = SubElement(described, "state_interface", name="position")
        SubElement(position, "param", name="initial_value").text = repr(home.get(joint.name, 0.0))
        SubElement(described, "state_interface", name="velocity")
    indent(robot)
    return '<?xml version="1.0"?>\n' + tostring(robot, encoding="unicode") + "\n"
