import mujoco
import numpy as np
import pytest

from cellwright.rendering.raycast import RayCaster
from tests.rendering.scenes import FLOOR, clutter, scene, unit_vectors

SHOWN = np.array([0, 1, 1, 0, 0, 0], np.uint8)
BOXES = """
<geom name="front" type="box" size=".1 1 1" pos="2 0 0" group="{front}" rgba="1 0 0 {opacity}"/>
<geom name="back" type="box" size=".1 1 1" pos="4 0 0" group="2"/>
"""
ORIGIN = np.zeros(3)
AHEAD = np.array([[1.0, 0, 0]])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_bundled_rays_hit_same_as_single_rays(seed: int) -> None:
    model, data = clutter(seed)
    rng = np.random.default_rng(seed)
    caster = RayCaster(model, data)
    for _ in range(5):
        origin = rng.uniform(-3, 3, 3)
        directions = unit_vectors(rng, 150)
        hits = caster.cast(origin, directions)
        for i, direction in enumerate(directions):
            geom, normal = np.full(1, -1, np.int32), np.zeros(3)
            distance = mujoco.mj_ray(model, data, origin, direction, SHOWN, True, -1, geom, normal)
            assert hits.geom[i] == geom[0]
            if geom[0] >= 0:
                assert hits.distance[i] == pytest.approx(distance, abs=1e-9)
                assert abs(hits.normal[i] @ normal) == pytest.approx(1)
                assert hits.normal[i] @ direction <= 0
            else:
                assert np.isinf(hits.distance[i])
                assert not hits.normal[i].any()


@pytest.mark.parametrize("seed", range(3))
def test_light_reaches_unobstructed_points(seed: int) -> None:
    model, data = clutter(seed)
    caster = RayCaster(model, data)
    directions = unit_vectors(np.random.default_rng(seed), 300)
    hits = caster.cast(ORIGIN, directions)
    met = hits.geom >= 0
    points = (directions * np.where(met, hits.distance, 0)[:, None])[met]
    lamp = np.array([0.5, -1.0, 2.6])
    reached = caster.reaches(lamp, points)
    assert 0 < reached.sum() < len(points)
    for point, lit in zip(points, reached, strict=True):
        reach = np.linalg.norm(point - lamp)
        distance = mujoco.mj_ray(model, data, lamp, (point - lamp) / reach, SHOWN, True, -1, None)
        assert lit == (distance < 0 or distance > reach - 1e-4)


def test_empty_bundle_has_no_hits() -> None:
    caster = RayCaster(*scene(FLOOR))
    assert len(caster.cast(ORIGIN, np.zeros((0, 3))).geom) == 0
    assert len(caster.reaches(ORIGIN, np.zeros((0, 3)))) == 0


@pytest.mark.parametrize(
    ("front", "opacity", "first", "opaque"),
    [
        (1, 1.0, "front", "front"),
        (2, 1.0, "front", "front"),
        (3, 1.0, "back", "back"),  # only touched, not seen
        (0, 1.0, "back", "back"),
        (1, 0.0, "back", "back"),  # invisible
        (1, 0.3, "front", "back"),
    ],
)
def test_rays_pass_translucent_geoms_on_request(front: int, opacity: float, first: str, opaque: str) -> None:
    model, data = scene(BOXES.format(front=front, opacity=opacity))
    caster = RayCaster(model, data)
    assert model.geom(int(caster.cast(ORIGIN, AHEAD).geom[0])).name == first
    assert model.geom(int(caster.cast(ORIGIN, AHEAD, through_translucent=True).geom[0])).name == opaque
    shaded = caster.reaches(ORIGIN, np.array([[3.9, 0, 0]]))[0]
    assert shaded == (opaque == "back")


def test_sheet_of_one_millimetre_casts_shadow() -> None:
    sheet = '<geom type="box" size="1 1 .0005" pos="0 0 -1" group="1"/>'
    below, on_top = RayCaster(*scene(sheet)).reaches(ORIGIN, np.array([[0.1, 0.1, -1.0005], [0.1, 0.1, -0.9995]]))
    assert on_top
    assert not below


def test_surface_seen_from_inside_faces_eye() -> None:
    hits = RayCaster(*scene('<geom type="box" size="1 1 1" group="1"/>')).cast(ORIGIN, AHEAD)
    assert hits.distance[0] == pytest.approx(1)
    assert hits.normal[0] == pytest.approx((-1, 0, 0))


def test_caster_leaves_model_and_state_unchanged() -> None:
    model, data = scene(BOXES.format(front=1, opacity=0.5))
    before = [a.copy() for a in (model.geom_group, model.geom_rgba, model.geom_matid)]
    data.geom_xpos[:] = 7.0
    caster = RayCaster(model, data)
    caster.cast(ORIGIN, AHEAD)
    for was, now in zip(before, (model.geom_group, model.geom_rgba, model.geom_matid), strict=True):
        assert np.array_equal(was, now)
    assert (data.geom_xpos == 7.0).all()


def test_rays_hit_bodies_at_qpos() -> None:
    model, data = scene(
        '<body name="ball"><freejoint/><geom type="sphere" size=".5" group="1"/></body>'
        '<body name="held" mocap="true" pos="0 9 0"><geom type="sphere" size=".5" group="1"/></body>'
    )
    data.qpos[:3] = (5, 0, 0)  # without kinematics after it
    data.mocap_pos[0] = (0, 3, 0)
    hits = RayCaster(model, data).cast(ORIGIN, np.array([[1.0, 0, 0], [0, 1.0, 0]]))
    assert hits.distance == pytest.approx((4.5, 2.5))
