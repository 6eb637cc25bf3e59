"""What PyBullet makes of URDF files: run as a program of its own, for Bullet can crash on what it does not like.

Reads {"path": …, "postures": […]} as JSON lines from a file, writes as many lines: {"path", "base", "joints", "frames"}
or {"path", "error"}. A posture is a list of numbers, of which each movable joint takes the next.
"""

import json
import sys
from pathlib import Path
from typing import Any

import pybullet


def told(client: int, path: str, postures: list[list[float]]) -> dict[str, Any]:
    """Joints in the order of their indices, and for each posture the frame of each link in that of the root link."""
    pybullet.resetSimulation(physicsClientId=client)
    try:
        body = pybullet.loadURDF(path, useFixedBase=True, physicsClientId=client)
    except pybullet.error as error:
        return {"path": path, "error": str(error)}
    count = pybullet.getNumJoints(body, physicsClientId=client)
    infos = [pybullet.getJointInfo(body, index, physicsClientId=client) for index in range(count)]
    joints = [
        {
            "name": info[1].decode("utf-8", "replace"),
            "type": info[2],
            "link": info[12].decode("utf-8", "replace"),
            "parent": info[16],
            "axis": info[13],
            "lower": info[8],
            "upper": info[9],
            "effort": info[10],
            "velocity": info[11],
        }
        for info in infos
    ]
    # the base is told of at its centre of mass
    inertial = pybullet.getDynamicsInfo(body, -1, physicsClientId=client)[3:5]
    centre_T_root = pybullet.invertTransform(*inertial)
    world_T_root = pybullet.multiplyTransforms(
        *pybullet.getBasePositionAndOrientation(body, physicsClientId=client), *centre_T_root
    )
    root_T_world = pybullet.invertTransform(*world_T_root)
    frames = []
    for posture in postures:
        driven = [index for index, info in enumerate(infos) if info[2] in (0, 1)]
        for index, value in zip(driven, posture, strict=False):
            pybullet.resetJointState(body, index, value, physicsClientId=client)
        states = [pybullet.getLinkState(body, i, 0, 1, physicsClientId=client)[4:6] for i in range(count)]
        frames.append([pybullet.multiplyTransforms(*root_T_world, *state) for state in states])
    base = pybullet.getBodyInfo(body, physicsClientId=client)[0].decode("utf-8", "replace")
    return {"path": path, "base": base, "joints": joints, "frames": frames}


def main(questions: Path, answers: Path) -> None:
    """Answer one line after the other; what is there already is not asked again."""
    client = pybullet.connect(pybullet.DIRECT)
    done = len(answers.read_text().splitlines()) if answers.exists() else 0
    with answers.open("a") as out:
        for line in questions.read_text().splitlines()[done:]:
            question = json.loads(line)
            out.write(json.dumps(told(client, question["path"], question["postures"])) + "\n")
            out.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
