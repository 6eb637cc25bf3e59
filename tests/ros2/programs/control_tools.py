"""Calls of ros2_control's own tools, in their order and with their timeouts: spawner, command line, plugins of rqt.

The tools are in no wheel. A call waits without end for its service by default; here it fails after TIMEOUT.
"""

from __future__ import annotations

import importlib
from types import TracebackType
from typing import Any
from xml.etree import ElementTree

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile

TIMEOUT = 10.0  # [s], of one call; that of the tools
ATTEMPTS = 3  # of one call
BEST_EFFORT, STRICT = 1, 2
MANAGER = "/controller_manager"


def kind_of(name: str, folder: str = "srv", package: str = "controller_manager_msgs") -> Any:
    """Return an interface."""
    return getattr(importlib.import_module(f"{package}.{folder}"), name)


class Tool:
    """A tool with a node of its own; use it in a `with`."""

    def __init__(self, name: str, manager: str = MANAGER) -> None:
        rclpy.init()
        self.node = rclpy.create_node(name)
        self.manager = manager

    def __enter__(self) -> Tool:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self.node.destroy_node()
        rclpy.try_shutdown()

    def call(self, service: str, kind: Any, **fields: Any) -> Any:
        """Call a service as the tools do: one client a call, spun in this thread, up to three times."""
        client = self.node.create_client(kind, service)
        assert client.wait_for_service(TIMEOUT), f"no service {service}"
        for _ in range(ATTEMPTS):
            future = client.call_async(kind.Request(**fields))
            rclpy.spin_until_future_complete(self.node, future, timeout_sec=TIMEOUT)
            if future.done():
                self.node.destroy_client(client)
                return future.result()
        raise AssertionError(f"{service} gave no answer")

    def ask(self, service: str, **fields: Any) -> Any:
        """Call a service of the controller manager by its name, such as `list_controllers`."""
        name = "".join(word.capitalize() for word in service.split("_"))
        return self.call(f"{self.manager}/{service}", kind_of(name), **fields)

    def first(self, topic: str, kind: Any, *, is_latched: bool = False) -> Any:
        """Return a message of a topic."""
        durability = DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE
        future: Any = rclpy.task.Future()
        subscription = self.node.create_subscription(
            kind, topic, future.set_result, QoSProfile(depth=1, durability=durability)
        )
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=TIMEOUT)
        self.node.destroy_subscription(subscription)
        assert future.done(), f"no message on {topic}"
        return future.result()


def spawn(*controllers: str, manager: str = MANAGER, as_group: bool = False) -> int:
    """Load, configure and activate controllers as `spawner` does; return its exit status."""
    with Tool(f"spawner_{controllers[0]}", manager) as tool:

        def activate(names: list[str]) -> bool:
            return bool(tool.ask("switch_controller", activate_controllers=names, strictness=STRICT).ok)

        for name in controllers:
            is_loaded = any(each.name == name for each in tool.ask("list_controllers").controller)
            if not is_loaded and not tool.ask("load_controller", name=name).ok:
                return 1
            if not tool.ask("configure_controller", name=name).ok:
                return 1
            if not as_group and not activate([name]):
                return 1
        return 0 if not as_group or activate(list(controllers)) else 1


def use_command_line() -> dict[str, Any]:
    """Call all that the verbs of `ros2 control` call; return what each prints, in short."""
    with Tool("ros2cli") as tool:
        state = kind_of("State", "msg", "lifecycle_msgs")
        components = tool.ask("list_hardware_components").component
        found = {
            "list_controllers": {each.name: each.state for each in tool.ask("list_controllers").controller},
            "list_controller_types": list(tool.ask("list_controller_types").types),
            "list_hardware_components": {each.name: [each.state.id, each.state.label] for each in components},
            "load_controller": tool.ask("load_controller", name="arm_controller").ok,
            "load another": tool.ask("load_controller", name="mine").ok,
            "cleanup_controller": tool.ask("cleanup_controller", name="arm_controller").ok,
            "unload_controller": tool.ask("unload_controller", name="arm_controller").ok,
            "reload_controller_libraries": tool.ask("reload_controller_libraries", force_kill=True).ok,
        }
        interfaces = tool.ask("list_hardware_interfaces")
        found["list_hardware_interfaces"] = [len(interfaces.command_interfaces), len(interfaces.state_interfaces)]
        switched = tool.ask("switch_controller", deactivate_controllers=["arm_controller"], strictness=STRICT)
        found["switch_controllers"] = [switched.ok, switched.message]
        targets = {"active": state(id=3, label="active"), "inactive": state(id=2, label="inactive")}
        for label, target in targets.items():
            answer = tool.ask("set_hardware_component_state", name=components[0].name, target_state=target)
            found[label] = [answer.ok, answer.state.label]
        return found


def watch_manager() -> dict[str, Any]:
    """Find the managers and their controllers as `rqt_controller_manager` does; return its table."""
    with Tool("rqt_controller_manager") as tool:
        suffix = "/list_controllers"
        while not (names := [name for name, _ in tool.node.get_service_names_and_types() if name.endswith(suffix)]):
            rclpy.spin_once(tool.node, timeout_sec=0.1)
        (manager,) = [name[: -len(suffix)] for name in names]
        tool.manager = manager
        table = {each.name: each.state for each in tool.ask("list_controllers").controller}
        package = "rcl_interfaces"
        listed = tool.call(f"{manager}/list_parameters", kind_of("ListParameters", package=package)).result.names
        types = [name for name in listed if name.endswith(".type")]
        answer = tool.call(f"{manager}/get_parameters", kind_of("GetParameters", package=package), names=types)
        parameter = kind_of("Parameter", "msg", package)(name="use_sim_time")
        parameter.value.type, parameter.value.bool_value = 1, True
        setting = tool.call(
            f"{manager}/set_parameters", kind_of("SetParameters", package=package), parameters=[parameter]
        )
        activity = tool.first(f"{manager}/activity", kind_of("ControllerManagerActivity", "msg"), is_latched=True)
        return {
            "table": table,
            "types": {
                name[: -len(".type")]: value.string_value for name, value in zip(types, answer.values, strict=True)
            },
            "set": [each.successful for each in setting.results],
            "activity": [
                [each.name, each.state.label] for each in (*activity.controllers, *activity.hardware_components)
            ],
        }


def jog() -> dict[str, Any]:
    """Find the controller of the arm as `rqt_joint_trajectory_controller` does, and send it a command."""
    offered = (
        *("list_controllers", "list_controller_types", "load_controller", "unload_controller"),
        *("switch_controller", "reload_controller_libraries"),
    )
    with Tool("rqt_joint_trajectory_controller") as tool:
        kinds = {f"{MANAGER}/{name}": "".join(word.capitalize() for word in name.split("_")) for name in offered}
        wanted = {name: [f"controller_manager_msgs/srv/{kind}"] for name, kind in kinds.items()}
        while not wanted.items() <= (types := dict(tool.node.get_service_names_and_types())).items():
            assert all(types.get(name, kind) == kind for name, kind in wanted.items())
            rclpy.spin_once(tool.node, timeout_sec=0.1)
        active = [each for each in tool.ask("list_controllers").controller if each.state == "active"]
        (controller,) = [each for each in active if "JointTrajectoryController" in each.type]
        required = controller.required_state_interfaces
        joints = [each.rpartition("/")[0] for each in required if each.endswith("/position")]
        description = tool.first("/robot_description", kind_of("String", "msg", "std_msgs"), is_latched=True)
        limits = {
            joint.get("name"): [float(limit.get(end, "nan")) for end in ("lower", "upper")]
            for joint in ElementTree.fromstring(description.data).iter("joint")
            for limit in joint.iter("limit")
        }
        topic, state = (
            f"/{controller.name}/controller_state",
            kind_of("JointTrajectoryControllerState", "msg", "control_msgs"),
        )
        before = tool.first(topic, state)
        trajectory, point = (
            kind_of(name, "msg", "trajectory_msgs") for name in ("JointTrajectory", "JointTrajectoryPoint")
        )
        target = point(positions=list(before.feedback.positions))
        target.positions[0] += 0.1
        target.time_from_start.nanosec = 500_000_000
        publisher = tool.node.create_publisher(trajectory, f"/{controller.name}/joint_trajectory", 1)
        while publisher.get_subscription_count() == 0:
            rclpy.spin_once(tool.node, timeout_sec=0.1)
        publisher.publish(trajectory(joint_names=list(before.joint_names), points=[target]))
        while True:
            after = tool.first(topic, state)
            if abs(after.feedback.positions[0] - target.positions[0]) < 0.01:
                break
        return {
            "joints": joints,
            "limited": [name for name in joints if name in limits and limits[name][0] < limits[name][1]],
            "factor": after.speed_scaling_factor,
            "output": list(after.output.positions) == list(after.reference.positions),
        }
