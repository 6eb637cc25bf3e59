"""PyBullet as the reference reader of URDF files, and the comparison with Cellwright's reader."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from cellwright.config.robot.model import JointType, RobotModel, link_poses
from cellwright.util.pose import Pose

PROGRAM = Path(__file__).with_name("pybullet_program.py")
TOLERANCE = 1e-5
"""Tolerance of link frames: [m], and of quaternions up to their sign."""


class Oracle:
    """Client of PyBullet, in a process that restarts after a crash of Bullet."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._start()

    def _start(self) -> None:
        read, write = os.pipe()
        command = [sys.executable, str(PROGRAM), str(write)]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            text=True,
            pass_fds=[write],
        )
        os.close(write)
        self._answers = os.fdopen(read)

    def ask(self, path: Path, postures: Sequence[Sequence[float]] = ()) -> dict[str, Any]:
        """Return PyBullet's reading of a file; {"error": …} if it refuses the file or crashes."""
        assert self._process is not None
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps({"path": str(path), "postures": postures}) + "\n")
        self._process.stdin.flush()
        answer = self._answers.readline()
        if answer:
            found: dict[str, Any] = json.loads(answer)
            return found
        self.close()
        self._start()
        return {"error": "crashed"}

    def close(self) -> None:
        """End the process."""
        assert self._process is not None
        self._process.kill()
        self._process.communicate()
        self._answers.close()


def differences(robot: RobotModel, reference: dict[str, Any], postures: Sequence[Sequence[float]]) -> list[str]:
    """Return the differences of a robot from PyBullet's reading of its file."""
    found = [] if robot.root == reference["base"] else [f"root {robot.root} instead of {reference['base']}"]
    ours = [(j.name, _kind(j.type), j.child, robot.link_indices[j.parent]) for j in robot.joints]
    theirs = [(j["name"], j["type"], j["link"], j["parent"]) for j in reference["joints"]]
    if ours != theirs:
        return [*found, f"joints {ours} instead of {theirs}"]
    for joint, their_joint in zip(robot.joints, reference["joints"], strict=True):
        lower, upper, effort, velocity = their_joint["limits"]
        unlimited = lower > upper or joint.type is JointType.CONTINUOUS
        expected = (
            -math.inf if unlimited else lower,
            math.inf if unlimited else upper,
            effort or math.inf,
            velocity or math.inf,
        )
        limits = joint.limits
        if joint.is_driven and (limits.lower, limits.upper, limits.effort, limits.velocity) != expected:
            found.append(f"{joint.name}: {limits} instead of {expected}")
    for posture, frames in zip(postures, reference["frames"], strict=True):
        poses = link_poses(robot, by_joint_name(robot, posture))
        for joint, (position, (x, y, z, w)) in zip(robot.joints, frames, strict=True):
            error = pose_distance(poses[joint.child], Pose(tuple(position), (w, x, y, z)))
            if error > TOLERANCE:
                found.append(f"{joint.child}: {error:g} away")
    return found


def by_joint_name(robot: RobotModel, posture: Sequence[float]) -> dict[str, float]:
    """Return a posture by joint name, of which each driven joint takes the next number."""
    return dict(zip((joint.name for joint in robot.driven), posture, strict=False))


def pose_distance(one: Pose, other: Pose) -> float:
    """Return the largest difference between two poses: positions [m], or quaternions up to their sign."""
    a, b = np.array(one.quaternion), np.array(other.quaternion)
    turned = min(np.abs(a - b).max(), np.abs(a + b).max())
    return float(max(np.abs(np.subtract(one.position, other.position)).max(), turned))


def _kind(type_: JointType) -> str:
    return "revolute" if type_ is JointType.CONTINUOUS else str(type_)
