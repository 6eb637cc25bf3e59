"""PyBullet's reading of URDF files, as a program of its own, since Bullet can crash on unusual files.

Reads {"path": …, "postures": […]} as lines of JSON, and writes a line for each to the file descriptor that is its
argument: {"base", "joints", "frames"}, or {"error"}. Each driven joint takes the next
number of a posture. A file is read once: another one needs another name.
"""

import json
import os
import sys
from typing import Any

import pybullet

TYPES = {0: "revolute", 1: "prismatic", 2: "spherical", 3: "planar", 4: "fixed"}


def reading(path: str, postures: list[list[float]]) -> dict[str, Any]:
    """Return the joints in the order of their indices, and for each posture the link frames in the root link's."""
    pybullet.resetSimulation()
    try:
        body = pybullet.loadURDF(path, useFixedBase=True)
    except pybullet.error as error:
        return {"error": str(error)}
    infos = [pybullet.getJointInfo(body, index) for index in range(pybullet.getNumJoints(body))]
    joints = [
        {
            "name": info[1].decode("utf-8", "replace"),
            "type": TYPES[info[2]],
            "link": info[12].decode("utf-8", "replace"),
            "parent": info[16],
            "axis": info[13],
            "limits": [info[8], info[9], info[10], info[11]],
            "is_driven": info[2] in (0, 1),
        }
        for info in infos
    ]
    # PyBullet reports the base at its centre of mass
    centre_T_root = pybullet.invertTransform(*pybullet.getDynamicsInfo(body, -1)[3:5])
    world_T_root = pybullet.multiplyTransforms(*pybullet.getBasePositionAndOrientation(body), *centre_T_root)
    root_T_world = pybullet.invertTransform(*world_T_root)
    frames = []
    for posture in postures:
        driven = [index for index, joint in enumerate(joints) if joint["is_driven"]]
        for index, value in zip(driven, posture, strict=False):
            pybullet.resetJointState(body, index, value)
        states = [pybullet.getLinkState(body, i, 0, 1)[4:6] for i in range(len(infos))]
        frames.append([pybullet.multiplyTransforms(*root_T_world, *state) for state in states])
    return {"base": pybullet.getBodyInfo(body)[0].decode("utf-8", "replace"), "joints": joints, "frames": frames}


if __name__ == "__main__":
    pybullet.connect(pybullet.DIRECT)
    with os.fdopen(int(sys.argv[1]), "w") as answers:  # standard output belongs to Bullet's messages
        for line in sys.stdin:
            question = json.loads(line)
            answers.write(json.dumps(reading(question["path"], question["postures"])) + "\n")
            answers.flush()
