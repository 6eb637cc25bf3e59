#!/usr/bin/env python3
"""Adds the solids of a cell to MoveIt's planning scene, and ends: bins, belt, AGVs at their load points, floor.

Links of the robot are left out, which MoveIt knows from its description. Run it again after a change of the cell:
`ros2 run cellwright_moveit_config planning_scene.py`.

Exit status: 0 done; 1 MoveIt or the cell refused, or interrupted; 2 MoveIt's messages are missing.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import rclpy
from geometry_msgs.msg import Point, Pose, Quaternion
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from std_srvs.srv import Trigger

try:
    from moveit_msgs.msg import CollisionObject, PlanningScene
    from moveit_msgs.srv import ApplyPlanningScene
    from shape_msgs.msg import Mesh, MeshTriangle, Plane, SolidPrimitive
except ImportError as missing:
    package = f"ros-{os.environ.get('ROS_DISTRO', 'DISTRIBUTION')}-moveit"
    sys.stderr.write(f"planning_scene: {missing}; install MoveIt and source it: apt-get install {package}\n")
    sys.exit(2)

SOLIDS, DESCRIPTION, APPLY = "cellwright/solids", "robot_description", "apply_planning_scene"
WORLD, FLOOR = "world", "floor"
PATIENCE = 5.0  # [s], then a line says what is waited for


class SceneNode:
    """Node that asks the cell for its solids and the robot's description, and gives MoveIt objects."""

    def __init__(self) -> None:
        self._node = rclpy.create_node("planning_scene")

    def solids(self) -> list[dict[str, Any]]:
        """Return the shapes of the cell in the world frame.

        Raises:
            RuntimeError: the cell refused.
        """
        answer = self._call(Trigger, SOLIDS, Trigger.Request())
        if not answer.success:
            raise RuntimeError(f"{SOLIDS}: {answer.message}")
        return list(json.loads(answer.message)[WORLD])

    def links(self) -> set[str]:
        """Return the names of the robot's links, from the latched topic of its description."""
        found: list[Any] = []
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._node.create_subscription(String, DESCRIPTION, found.append, latched)
        self._wait(lambda timeout: self._spin(timeout, lambda: bool(found)), f"topic {DESCRIPTION}")
        robot = ElementTree.fromstring(found[0].data)  # noqa: S314  # as trusted as the cell's other messages
        return {str(link.get("name")) for link in robot.findall("link")}

    def apply(self, objects: list[Any]) -> None:
        """Add objects to MoveIt's planning scene, in place of earlier ones of the same names.

        Raises:
            RuntimeError: MoveIt refused.
        """
        scene = PlanningScene(is_diff=True)
        scene.robot_state.is_diff = True
        scene.world.collision_objects = objects
        if not self._call(ApplyPlanningScene, APPLY, ApplyPlanningScene.Request(scene=scene)).success:
            raise RuntimeError(f"{APPLY}: MoveIt refused the objects; its reason is in the output of move_group")

    def close(self) -> None:
        """Leave the graph."""
        self._node.destroy_node()

    def _call(self, kind: Any, name: str, request: Any) -> Any:
        client = self._node.create_client(kind, name)
        self._wait(client.wait_for_service, f"service {name}")
        future = client.call_async(request)
        self._wait(lambda timeout: self._spin(timeout, future.done), f"answer of {name}")
        return future.result()

    def _spin(self, timeout: float, is_done: Callable[[], bool]) -> bool:
        rclpy.spin_once(self._node, timeout_sec=timeout)
        return is_done()

    def _wait(self, is_done: Callable[[float], bool], what: str) -> None:
        """Wait for something that may be started later; `is_done` waits up to a time [s]."""
        while not is_done(PATIENCE):
            if not rclpy.ok():
                raise ExternalShutdownException
            self._node.get_logger().info(f"waiting for {what}")


def collision_objects(solids: list[dict[str, Any]], links: set[str]) -> list[Any]:
    """Return a `CollisionObject` for each body that is no link of the robot.

    Args:
        solids: shapes in the world frame, as the service `cellwright/solids` gives them.
        links: names of the robot's links.

    Raises:
        RuntimeError: a shape is of an unknown type.
    """
    found: dict[str, Any] = {}
    for shape in solids:
        body = FLOOR if shape["body"] == WORLD else str(shape["body"])
        if body not in links:
            _add_shape(found.setdefault(body, CollisionObject(id=body, operation=CollisionObject.ADD)), shape)
    for made in found.values():
        made.header.frame_id = WORLD
    return list(found.values())


def _add_shape(made: Any, shape: dict[str, Any]) -> None:
    if shape["type"] == "plane":
        made.planes.append(Plane(coef=[0.0, 0.0, 1.0, 0.0]))  # z = 0
        made.plane_poses.append(_pose(shape))
    elif shape["type"] == "mesh":
        vertices = [Point(x=x, y=y, z=z) for x, y, z in shape["vertices"]]
        triangles = [MeshTriangle(vertex_indices=corners) for corners in shape["triangles"]]
        made.meshes.append(Mesh(vertices=vertices, triangles=triangles))
        made.mesh_poses.append(_pose(shape))
    else:
        for kind, dimensions, along in _primitives(shape["type"], shape["size"]):
            made.primitives.append(SolidPrimitive(type=kind, dimensions=dimensions))
            made.primitive_poses.append(_pose(shape, along))


def _primitives(kind: str, size: list[float]) -> list[tuple[int, list[float], float]]:
    """Return type, dimensions and place along z [m] of each primitive that a shape consists of."""
    if kind == "box":
        return [(SolidPrimitive.BOX, [2 * half for half in size], 0.0)]
    if kind == "sphere":
        return [(SolidPrimitive.SPHERE, list(size), 0.0)]
    if kind not in ("cylinder", "capsule"):
        raise RuntimeError(f"{SOLIDS}: unknown type of shape {kind!r}; update with: cellwright ros2-workspace")
    radius, half = size
    tube = (SolidPrimitive.CYLINDER, [2 * half, radius], 0.0)  # height, radius
    ends = [(SolidPrimitive.SPHERE, [radius], end) for end in (-half, half)]
    return [tube, *ends] if kind == "capsule" else [tube]


def _pose(shape: dict[str, Any], along: float = 0.0) -> Any:
    """Return the pose of a shape, moved along its z axis [m]."""
    w, x, y, z = shape["quaternion"]
    axis = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
    place = [start + along * part for start, part in zip(shape["position"], axis, strict=True)]
    position = Point(x=place[0], y=place[1], z=place[2])
    return Pose(position=position, orientation=Quaternion(x=x, y=y, z=z, w=w))


def main() -> int:
    """Add the solids; return the exit status."""
    rclpy.init(args=sys.argv)
    node = SceneNode()
    try:
        objects = collision_objects(node.solids(), node.links())
        node.apply(objects)
    except RuntimeError as error:
        if rclpy.ok():  # else a signal ended it, whatever rclpy says about that
            sys.stderr.write(f"planning_scene: {error}\n")
        return 1
    except (KeyboardInterrupt, ExternalShutdownException):
        return 1
    finally:
        node.close()
        rclpy.try_shutdown()
    sys.stdout.write(f"planning_scene: added {len(objects)} objects\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
