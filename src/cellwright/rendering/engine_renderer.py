"""Engine renderer: scenes drawn by MuJoCo's own renderer through OpenGL, in the look of the ray renderer."""

import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import PictureRequest
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.engine import EngineScene
from cellwright.rendering.scene.joining import join_shapes
from cellwright.rendering.shading import HORIZON, LINE, LINE_SHADE, TILE, background, to_screen
from cellwright.util.pose import Vector3

_NEAR, _FAR = 0.02, 200.0  # [m]
_HAZE = (18.0, 36.0)
"""Distances [m] at which floors start and end to fade; the rest is not drawn. The engine's haze is a surface, which
would cut through a cell if it began at the ray renderer's 9 m."""
_MAX_SAMPLES, _MAX_SIDE = 3, 8192  # along a side of a pixel; [pixels] before downscaling
_SHADOW_SIZES = (128, 1024), (math.inf, 2048)
"""Side of the shadow map [texels] of pictures up to a side [px]: without a GPU, a map takes longer than a picture."""
_SHADOW_REACH = (2.5, 6.5)  # [m], smallest and largest, around the point from which the lamp is placed
_CUTOFF = 80.0  # [degrees], half the lamp's opening angle; the engine's maximum
_SKY_SIDE, _FLOOR_SIDE = 64, 512  # [texels]
_FAR_FLOOR = "far floor"  # first words of the names of floors for depths
_UNSEEN, _TRANSLUCENT = 0, 5  # geom groups of the engine that are no layers
_FLOORS = ((42.0, 2.1), (1.05 * _FAR, 1.05 * _FAR))
"""Reach [m] of an endless floor around the camera, and distance [m] of its vertices: for colours, which are lit at the
vertices and end in the haze, and for depths."""

# Fitted to pictures of the ray renderer. The engine adds light in sRGB, not linearly: these are no physical amounts.
_AMBIENT = (0.643, 0.656, 0.664)
_DIFFUSE = (0.578, 0.556, 0.522)
_SPECULAR = (0.22, 0.22, 0.22)


class EngineRenderer:
    """Renderer of a scene by OpenGL, with the interface of `CastRenderer`, for the thread that made it.

    Args:
        scene: the scene to draw.
        description: text about the renderer. Its context is current in this thread.
    """

    def __init__(self, scene: Scene, description: str) -> None:
        self.description = description
        self._scene = EngineScene(join_shapes(scene), prepare=_set_surroundings)
        self._model = model = self._scene.model
        self._groups = np.where(model.geom_rgba[:, 3] < 1, _TRANSLUCENT, model.geom_group)
        self._endless = (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & (model.geom_size[:, :2] <= 0).all(axis=1)
        is_far = np.array([model.geom(geom).name.startswith(_FAR_FLOOR) for geom in range(model.ngeom)])
        self._floors = self._endless & ~is_far, self._endless & is_far
        self._drawn: Any = mujoco.MjvScene(model, model.ngeom + 100)
        self._drawn.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self._targets: dict[int, Any] = {}
        self._target: Any = None

    def colour(self, frame: SceneFrame, request: PictureRequest) -> NDArray[np.uint8]:
        """Return a picture (height, width, 3), sRGB.

        It is drawn up to three times as wide and high, and then downscaled. That smooths the edges of shadows;
        multisampling would leave them jagged, and takes as long without a GPU.
        """
        self._place(frame, request, depth=False)
        camera, width, height, lamp, about = request.camera, request.width, request.height, request.lamp, request.about
        reach = _SHADOW_REACH[1]
        # No shared light: shadows are as sharp as the picture needs.
        if about is None:
            about = camera.target
            reach = min(max(math.dist(camera.eye, about), _SHADOW_REACH[0]), reach)
        shadow_angle = math.degrees(math.asin(min(0.9, reach / math.hypot(*lamp))))  # half the opening angle of a cone
        self._target.shadowScale = shadow_angle / _CUTOFF
        spot, directional = mujoco.mjtLightType.mjLIGHT_SPOT, mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        at = np.add(about, lamp)
        self._drawn.nlight = 2
        _set_light(self._drawn.lights[0], spot, at, np.negative(lamp), diffuse=_DIFFUSE, specular=_SPECULAR)
        _set_light(self._drawn.lights[1], directional, at, (0.0, 0.0, -1.0), ambient=_AMBIENT)
        self._drawn.lights[0].castshadow = request.shadows
        self._drawn.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = request.shadows
        times = max(1, min(request.samples, _MAX_SAMPLES, _MAX_SIDE // max(width, height)))
        large = np.empty((times * height, times * width, 3), np.uint8)
        self._draw(large, None)
        if times == 1:
            return large[::-1]
        total = np.full((height, width, 3), times**2 // 2, np.uint16)
        for row in range(times):
            for column in range(times):
                total += large[row::times, column::times]
        return (total // times**2).astype(np.uint8)[::-1]

    def depth(self, frame: SceneFrame, request: PictureRequest) -> NDArray[np.float32]:
        """See `CastRenderer.depth`."""
        self._place(frame, request, depth=True)
        self._drawn.nlight = 0
        nearness = np.empty((request.height, request.width), np.float32)  # 1 at the near plane, 0 at the far plane
        self._draw(None, nearness)
        depth: NDArray[np.float32] = _NEAR * _FAR / (_NEAR + nearness[::-1] * np.float32(_FAR - _NEAR))
        depth[nearness[::-1] <= 0] = np.inf
        return depth

    def _place(self, frame: SceneFrame, request: PictureRequest, *, depth: bool) -> None:
        """Move the bodies and the camera to their poses."""
        self._target = self._target_for(max(request.width, request.height))
        camera, aspect = request.camera, request.width / request.height
        turn = camera.world_R_optical
        self._scene.show(frame)
        option = mujoco.MjvOption()
        option.geomgroup[:] = 1
        option.geomgroup[_UNSEEN] = 0
        option.geomgroup[_TRANSLUCENT] = not depth
        everything = mujoco.mjtCatBit.mjCAT_ALL
        free = mujoco.MjvCamera()
        far = _FAR if depth else _HAZE[1]
        seen = frame.shown[self._model.geom_bodyid] & ~self._floors[not depth]
        # What is out of view may cast a shadow into it.
        if depth or not request.shadows:
            seen &= self._is_near_view(camera, turn, aspect, far)
        self._model.geom_group[:] = np.where(seen, self._groups, _UNSEEN)
        self._aim(camera, turn, aspect, far)  # puts endless floors under the camera, which the update then moves
        mujoco.mjv_updateScene(self._model, self._scene.data, option, None, free, everything, self._drawn)
        place = np.cumsum(option.geomgroup[self._model.geom_group]) - 1  # of each geom among those to draw
        for index in place[self._floors[depth]].tolist():
            # the texture of a finite plane counts in halves of its size
            self._drawn.geoms[index].texrepeat = (2 * _FLOORS[depth][0] / TILE,) * 2
        self._aim(camera, turn, aspect, far)
        for flag in (mujoco.mjtRndFlag.mjRND_HAZE, mujoco.mjtRndFlag.mjRND_SKYBOX):
            self._drawn.flags[flag] = not depth

    def _target_for(self, side: int) -> Any:
        """Return the OpenGL objects for pictures of a side [px], which are made for the first one."""
        size = next(texels for largest, texels in _SHADOW_SIZES if side <= largest)
        if size not in self._targets:
            self._model.vis.quality.shadowsize = size
            self._targets[size] = target = _make_target(self._model, self._floors)
            target.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        return self._targets[size]

    def _is_near_view(self, camera: Camera, turn: NDArray[np.float64], aspect: float, far: float) -> NDArray[np.bool_]:
        """Return for each geom whether the sphere around it touches the pyramid that a camera sees."""
        radius = self._model.geom_rbound
        right, down, ahead = ((self._scene.data.geom_xpos - camera.eye) @ turn).T
        near: NDArray[np.bool_] = self._endless | ((ahead > -radius) & (ahead < far + radius))
        for aside, slope in ((right, math.tan(camera.fov / 2) * aspect), (down, math.tan(camera.fov / 2))):
            near &= self._endless | (np.abs(aside) - slope * ahead < radius * math.hypot(1.0, slope))
        return near

    def _aim(self, camera: Camera, turn: NDArray[np.float64], aspect: float, far: float) -> None:
        top = _NEAR * math.tan(camera.fov / 2)
        for eye in self._drawn.camera:
            eye.pos, eye.forward, eye.up = camera.eye, turn[:, 2], -turn[:, 1]
            eye.frustum_near, eye.frustum_far = _NEAR, far
            eye.frustum_bottom, eye.frustum_top = -top, top
            eye.frustum_center, eye.frustum_width = 0.0, top * aspect

    def _draw(self, colour: NDArray[np.uint8] | None, depth: NDArray[np.float32] | None) -> None:
        """Draw into one of the arrays (height, width, …); its first row is the lowest."""
        (array,) = (each for each in (colour, depth) if each is not None)
        height, width = array.shape[:2]
        target = self._target
        # Another renderer may have set its own.
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, target)
        if (target.offWidth, target.offHeight) != (width, height):
            mujoco.mjr_resizeOffscreen(width, height, target)
        area = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(area, self._drawn, target)
        mujoco.mjr_readPixels(colour, depth, area, target)


def _make_target(model: Any, floors: Sequence[NDArray[np.bool_]]) -> Any:
    """Return the OpenGL objects of a model.

    The engine splits an endless plane into 40 000 quads; that takes longer to draw than the rest of a small picture.
    While the objects are made, endless planes are finite.
    """
    sizes = model.geom_size.copy()
    for floor, (reach, step) in zip(floors, _FLOORS, strict=True):
        model.geom_size[floor] = (reach, reach, step)
    target: Any = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_50)
    model.geom_size[:] = sizes
    return target


def _set_light(
    light: Any,
    kind: Any,
    position: ArrayLike,
    direction: ArrayLike,
    *,
    ambient: Vector3 = (0.0, 0.0, 0.0),
    diffuse: Vector3 = (0.0, 0.0, 0.0),
    specular: Vector3 = (0.0, 0.0, 0.0),
) -> None:
    light.type, light.pos, light.dir = kind, position, np.divide(direction, np.linalg.norm(direction))
    light.attenuation, light.cutoff, light.exponent = (1.0, 0.0, 0.0), _CUTOFF, 0.0
    light.headlight, light.castshadow = False, False
    light.ambient, light.diffuse, light.specular = ambient, diffuse, specular


def _set_surroundings(spec: Any) -> None:
    """Add the ray renderer's sky, haze and floor lines to a model."""
    spec.stat.extent = 1.0  # the unit of the lengths below
    spec.visual.map.znear, spec.visual.map.zfar = _NEAR, _FAR
    spec.visual.map.haze = 1 - _HAZE[0] / _HAZE[1]
    spec.visual.rgba.haze = (*(to_screen(HORIZON) / 255).tolist(), 1.0)
    spec.visual.quality.offsamples = 0
    for name, kind, picture in (
        ("sky", mujoco.mjtTexture.mjTEXTURE_SKYBOX, _sky()),
        ("floor", mujoco.mjtTexture.mjTEXTURE_2D, _tile()),
    ):
        height, width, _ = picture.shape
        spec.add_texture(name=name, type=kind, width=width, height=height, nchannel=3).data = picture.tobytes()
    # The engine counts in half metres.
    repeat = 2 / TILE
    floor = spec.add_material(name="floor", texuniform=True, texrepeat=(repeat, repeat))
    floor.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "floor"
    for number, geom in enumerate([*spec.geoms]):
        if geom.type == mujoco.mjtGeom.mjGEOM_PLANE:
            geom.material = "floor"
            if not geom.size[:2].any():
                place = {"pos": geom.pos, "quat": geom.quat}
                same = {"type": geom.type, "size": geom.size, "group": geom.group, "rgba": geom.rgba}
                geom.parent.add_geom(name=f"{_FAR_FLOOR} {number}", contype=0, conaffinity=0, **place, **same)


def _sky() -> NDArray[np.uint8]:
    """Sky on the sides of a cube, one below the other: right, left, up, down, front, back."""
    middle = (np.arange(_SKY_SIDE) + 0.5) / _SKY_SIDE * 2 - 1
    across, up = np.meshgrid(middle, -middle)
    length = np.sqrt(1 + across**2 + up**2)
    side, above = up / length, 1 / length
    heights = np.concatenate([side, side, above, -above, side, side]).reshape(-1)
    return to_screen(background(np.column_stack([heights, heights, heights]))).reshape(-1, _SKY_SIDE, 3)


def _tile() -> NDArray[np.uint8]:
    """White tile with lines through its middle, which the engine puts at the whole metres of a floor."""
    tile = np.full((_FLOOR_SIDE, _FLOOR_SIDE, 3), 255, np.uint8)
    middle, half = _FLOOR_SIDE // 2, round(LINE / TILE * _FLOOR_SIDE / 2)
    line = slice(middle - half, middle + half)
    tile[line] = tile[:, line] = to_screen(np.full(3, LINE_SHADE, np.float32))
    return tile
