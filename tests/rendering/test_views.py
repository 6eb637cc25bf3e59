"""Named views, in the cell itself."""

import math

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.build import World, build_world
from cellwright.config.trial.trial import Trial
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import pixel_points
from cellwright.rendering.raycast import RayCaster
from cellwright.rendering.scene.engine import EngineScene, SceneCapture
from cellwright.rendering.views import camera_of, gear2017_views, viewpoint
from cellwright.util.errors import UnknownNameError, UsageError
from tests.rendering.scenes import project

WIDTH, HEIGHT = 64, 36

WORTH_SEEING = {
    "overview": [(0.3, 3.15, 0.755), (0.3, -3.15, 0.755), (-0.3, 0.23, 0.75), (0.3, 2.1, 1.0), (1.21, 3.5, 0.91)],
    "bins": [(x, y, 0.75) for x in (-1.0, -0.3) for y in (-1.33, 0.995)],
    "agv1": [(0.3 + x, 3.15 + y, 0.755) for x in (-0.25, 0.25) for y in (-0.35, 0.35)],
    "agv2": [(0.3 + x, -3.15 + y, 0.755) for x in (-0.25, 0.25) for y in (-0.35, 0.35)],
    "belt": [(1.21, y, 0.91) for y in (-0.5, 0, 1, 2, 3)],
}

BODIES_IN_VIEW = {
    "overview": {"agv1", "agv2", "conveyor_belt", "upper_arm_link", *(f"bin{n}" for n in range(1, 9))},
    "bins": {f"bin{n}" for n in range(1, 9)},
    "agv1": {"agv1", "agv1::kit_tray_1::kit_tray_1::tray"},
    "agv2": {"agv2", "agv2::kit_tray_2::kit_tray_2::tray"},
    "belt": {"conveyor_belt"},
}


Casters = tuple[World, RayCaster, SceneCapture, EngineScene, RayCaster]


@pytest.fixture(scope="module")
def casters() -> Casters:
    """Casters of rays to the engine's model, which knows static bodies, and to the scene, which has all shapes."""
    world = build_world(Trial("views", has_arm=True))
    data = mujoco.MjData(world.model)
    world.set_initial_posture(data)
    mujoco.mj_kinematics(world.model, data)
    capture = SceneCapture(world.model, world.visuals)
    shown = EngineScene(capture.scene)
    shown.show(capture.frame(data, 0))
    return world, RayCaster(world.model, data), capture, shown, RayCaster(shown.model, shown.data)


@pytest.mark.parametrize("name", gear2017_views())
def test_view_has_its_subject_in_picture(name: str) -> None:
    column, row, depth = project(gear2017_views()[name], np.array(WORTH_SEEING[name]), 1280, 720).T
    assert (depth > 0).all()
    assert ((column > 0) & (column < 1280) & (row > 0) & (row < 720)).all()


@pytest.mark.parametrize("name", gear2017_views())
def test_view_of_subject_is_unobstructed(name: str, casters: Casters) -> None:
    world, of_model, capture, shown, of_scene = casters
    camera = gear2017_views()[name]
    directions = camera.directions(pixel_points(np.arange(WIDTH * HEIGHT), WIDTH, samples=1), WIDTH, HEIGHT)
    static, hits = (caster.cast(np.array(camera.eye), directions) for caster in (of_model, of_scene))
    unobstructed = static.geom[np.isclose(static.distance, hits.distance, atol=1e-3)]
    seen = {world.model.body(int(world.model.geom_bodyid[geom])).name for geom in unobstructed if geom >= 0}
    seen |= {capture.scene.bodies[int(shown.model.geom_bodyid[geom])] for geom in hits.geom if geom >= 0}
    assert BODIES_IN_VIEW[name] <= seen
    assert hits.distance.min() > 0.4, "the camera stands in the open"


def test_unknown_view_is_refused_with_suggestion() -> None:
    with pytest.raises(UnknownNameError, match=r"did you mean overview.*agv1"):
        camera_of("overveiw", gear2017_views())


def camera(text: str) -> Camera:
    return camera_of(viewpoint(text), gear2017_views())


def test_viewpoint_is_a_name_or_numbers() -> None:
    assert camera("bins") is gear2017_views()["bins"]
    assert camera("-4,-3,3.5:0,0,0.6") == Camera((-4, -3, 3.5), (0, 0, 0.6), fov=math.radians(45))
    assert camera("1,2,3:0,0,0:60").fov == pytest.approx(math.radians(60))
    with pytest.raises(UnknownNameError, match="did you mean bins"):
        camera("bin")


@pytest.mark.parametrize("text", [":", "1,2,3:", "1,2:3,4,5", "1,2,x:0,0,0", "1,2,3:0,0,0:1:2", "1,2,3:0,0,0:x"])
def test_viewpoint_of_malformed_text_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="give its position and target"):
        viewpoint(text)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1,2,3:1,2,3", "camera position and target must differ"),
        ("nan,0,0:1,1,1", "must be finite"),
        ("1e300,2,3:0,0,0", "coordinates must be at most"),
        ("1,2,3:0,0,0:180", r"between 0 and 180 degrees \(got 180\)"),
        ("1,2,3:0,0,0:0", r"between 0 and 180 degrees \(got 0\)"),
        ("1,2,3:0,0,0:nan", r"got nan"),
    ],
)
def test_viewpoint_of_invalid_numbers_is_refused(text: str, reason: str) -> None:
    with pytest.raises(UsageError, match=f"^{text}: .*{reason}"):
        viewpoint(text)


@pytest.mark.parametrize(("text", "right"), [("0,0,5:0,0,0", (0.0, -1.0, 0.0)), ("0,0,1:0,0,3", (0.0, 1.0, 0.0))])
def test_camera_straight_down_or_up_has_x_axis_upwards(text: str, right: tuple[float, ...]) -> None:
    assert camera(text).world_R_optical[:, 0] == pytest.approx(right)
