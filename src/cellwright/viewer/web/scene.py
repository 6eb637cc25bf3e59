"""Scene nodes of the page: bodies, their shadows, light, sky and ground.

A shadow map is coarse, some centimetres here, and a surface compared with itself in it shows stripes. viser offers no
margin for that comparison. So the shadow casters stand a margin farther from the lamp than the drawn bodies, which cast
no shadows.
"""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene import SEEN, TOUCHED, Scene, SceneFrame, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.scene.triangles import Triangles
from cellwright.util.pose import Vector3
from cellwright.viewer.web.meshes import Colour, Material, glb, node_name, surface
from cellwright.viewer.web.page import Feature, Page, TimelineFrame
from cellwright.viewer.web.views import TAB

_FEW = 4
"""Number of bodies of the same shapes from which they are drawn as one batch."""
_FLOOR = Material(1.0)
_TOUCHED_COLOURS: tuple[Colour, ...] = ((0.16, 0.47, 0.71, 0.62), (0.85, 0.45, 0.13, 0.62), (0.35, 0.6, 0.35, 0.62))
_LAMPS = {"robot": (3.2, -4.6, 6.0)}  # a robot faces +x, and the viewer looks at it from there
_LAMP = (-3.0, -4.5, 7.0)
_MARGIN = 0.03  # [m]
_MIN_SIZE = 0.07  # [m]: shadows of smaller bodies are not missed
_MIN_HEIGHT = 0.02  # [m]: a body flat on the floor casts none
_UNSEEN = Material(opacity=0.0)
_BLACK: Colour = (0.0, 0.0, 0.0, 1.0)
PLAIN = "CELLWRIGHT_PAGE_PLAIN"
"""Environment variable: if set, the page starts without shadows."""
HAZE = (203, 212, 221)
"""Colour where the ground ends and the sky begins."""
_BRAND = (28, 100, 160)
_FADE_FROM, _FADE_TO = 11.0, 34.0  # [m] from the eye
_SKY = 60.0  # [m]: radius of the sky sphere, beyond the haze


class Bodies(Feature):
    """Bodies as seen, and as the engine collides them."""

    def __init__(self) -> None:
        self._looks: BodyNodes | None = None
        self._touched: BodyNodes | None = None
        self._newest: SceneFrame | None = None
        self._box: Any = None

    def on_scene(self, scene: Scene) -> None:
        """Put the bodies of a scene on the page."""
        self._newest = None
        self._looks, self._touched = BodyNodes(self.page, scene, "bodies", SEEN), None
        if self._box is None:
            with self.page.tab(TAB):
                self._box = self.page.server.gui.add_checkbox(
                    "Collision shapes", initial_value=False, hint="Shapes that the physics engine uses"
                )
            self._box.on_update(lambda _event: self.show_touched(self._box.value))
        if self._box.value:
            self.show_touched(True)

    def show(self, moment: TimelineFrame) -> None:
        """Move the bodies to their poses."""
        self._newest = moment.frame
        for nodes in (self._looks, self._touched):
            if nodes is not None:
                nodes.show(moment)

    def show_touched(self, is_on: bool) -> None:  # noqa: FBT001
        """Show the collision shapes of the bodies in place of their looks."""
        if self._looks is None or self.page.scene is None:
            return
        if is_on and self._touched is None:
            self._touched = BodyNodes(self.page, self.page.scene, "touched", TOUCHED)
            if self._newest is not None:
                self._touched.show(TimelineFrame.of(self._newest))
        if self._touched is not None:
            self._touched.set_visible(is_on)
        self._looks.set_visible(not is_on)


class BodyNodes:
    """Nodes for those shapes of a scene's bodies that are in `layers`, below a node of this name."""

    def __init__(self, page: Page, scene: Scene, name: str, layers: Collection[ShapeLayer]) -> None:
        self._scene = page.server.scene
        self._root = self._scene.add_frame(f"{page.root}/{name}", show_axes=False)
        self._singles: list[tuple[int, Any]] = []
        self._alike: list[tuple[NDArray[np.intp], Any]] = []
        is_touched = ShapeLayer.TOUCH in layers
        shapes: dict[int, list[SceneShape]] = defaultdict(list)
        for shape in scene.shapes:
            if shape.layer in layers:
                shapes[shape.body].append(shape)
        groups: dict[Any, list[int]] = defaultdict(list)
        for body, its in shapes.items():
            groups[tuple((s.form, s.size, s.pose, s.colour, s.mesh) for s in its)].append(body)
        for bodies in groups.values():
            data = glb(_pieces(shapes[bodies[0]], scene, is_touched=is_touched))
            paths = [f"{page.root}/{name}/{node_name(scene.bodies[body])}" for body in bodies]
            if len(bodies) < _FEW:
                for body, path in zip(bodies, paths, strict=True):
                    self._singles.append((body, self._scene.add_glb(path, data, cast_shadow=False)))
            else:
                handle = self._scene.add_batched_glb(
                    f"{paths[0]} and copies",
                    data,
                    batched_wxyzs=np.tile((1.0, 0.0, 0.0, 0.0), (len(bodies), 1)),
                    batched_positions=np.zeros((len(bodies), 3)),
                    batched_scales=np.zeros((len(bodies), 3)),
                    lod="off",
                    cast_shadow=False,
                )
                self._alike.append((np.array(bodies), handle))

    def set_visible(self, is_visible: bool) -> None:  # noqa: FBT001
        """Show or hide them all."""
        self._root.visible = is_visible

    def show(self, moment: TimelineFrame) -> None:
        """Move them to their poses; only changes are sent."""
        frame, moved, switched = moment.frame, moment.moved, moment.switched
        for body, handle in self._singles:
            _place(handle, body, moment)
        for bodies, handle in self._alike:
            if switched[bodies].any():
                handle.batched_scales = np.repeat(frame.shown[bodies, None], 3, axis=1).astype(np.float32)
            if moved[bodies].any():
                handle.batched_positions, handle.batched_wxyzs = frame.poses[bodies, :3], frame.poses[bodies, 3:]


def _place(handle: Any, body: int, moment: TimelineFrame) -> None:
    """Move the node of a body to its pose; only changes are sent."""
    frame = moment.frame
    if moment.moved[body]:
        handle.position, handle.wxyz = frame.poses[body, :3], frame.poses[body, 3:]
    if moment.switched[body]:
        handle.visible = bool(frame.shown[body])


def _pieces(shapes: Sequence[SceneShape], scene: Scene, *, is_touched: bool) -> list[tuple[Any, Colour, Material]]:
    if is_touched:
        return [
            (surface(shape, scene), colour, Material(0.9, 0.0, colour[3]))
            for number, shape in enumerate(shapes)
            for colour in [_TOUCHED_COLOURS[number % len(_TOUCHED_COLOURS)]]
        ]
    return [
        (surface(shape, scene), shape.colour, _FLOOR if shape.form is ShapeType.PLANE else material(shape.colour))
        for shape in shapes
    ]


def material(colour: Colour) -> Material:
    """Material for a colour: light grey is metal, the rest is paint or rubber."""
    red, green, blue, opacity = colour
    brightness = max(red, green, blue)
    tint = brightness - min(red, green, blue)
    if opacity < 1:
        return Material(0.15, 0.0, round(opacity, 2))
    if tint < 0.06 and 0.4 < brightness < 0.78:
        return Material(0.45, 0.2)
    return Material(0.85 if brightness < 0.2 else 0.7)


class Shadows(Feature):
    """Shadow casters of the bodies."""

    def __init__(self) -> None:
        self._handles: dict[int, Any] = {}

    def on_scene(self, scene: Scene) -> None:
        """Create the shadow casters."""
        self._handles = {}
        lamp = np.array(lamp_of(self.page.about))
        root = f"{self.page.root}/shadows"
        nodes = self.page.server.scene
        nodes.add_frame(root, show_axes=False, position=-_MARGIN / np.linalg.norm(lamp) * lamp)
        shapes: dict[int, list[SceneShape]] = defaultdict(list)
        for shape in scene.shapes:
            if shape.layer in SEEN and shape.form is not ShapeType.PLANE and shape.colour[3] >= 1:
                shapes[shape.body].append(shape)
        for body, its in shapes.items():
            surfaces = [
                found for found in (surface(shape, scene) for shape in its) if _matters(found, is_still=body == 0)
            ]
            if surfaces and (body == 0 or _extent(surfaces) >= _MIN_SIZE):
                data = glb((found, _BLACK, _UNSEEN) for found in surfaces)
                self._handles[body] = nodes.add_glb(f"{root}/{body}", data, cast_shadow=True, receive_shadow=False)

    def show(self, moment: TimelineFrame) -> None:
        """Move the casters with the bodies."""
        for body, handle in self._handles.items():
            _place(handle, body, moment)


def lamp_of(about: Mapping[str, Any]) -> Vector3:
    """Direction to the light in the world."""
    return _LAMPS.get(str(about.get("kind")), _LAMP)


def _matters(found: Triangles, *, is_still: bool) -> bool:
    return len(found.points) > 0 and not (is_still and float(found.points[:, 2].max()) < _MIN_HEIGHT)


def _extent(surfaces: list[Triangles]) -> float:
    points = np.concatenate([each.points for each in surfaces])
    return float((points.max(axis=0) - points.min(axis=0)).max())


class Environment(Feature):
    """Lights, sky and ground, created once; without shadows at first if `is_plain`."""

    def __init__(self, *, is_plain: bool = False) -> None:
        self._is_plain = is_plain
        self._key: Any = None

    def on_scene(self, scene: Scene) -> None:  # noqa: ARG002
        """Create light, sky and ground."""
        page, server = self.page, self.page.server
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=_BRAND)
        if self._key is not None:
            self._key.position = lamp_of(page.about)
            return
        nodes = server.scene
        nodes.configure_default_lights(enabled=False)
        nodes.configure_environment_map("warehouse", environment_intensity=0.12)
        key = self._key = nodes.add_light_directional(
            "/light/key",
            color=(255, 246, 232),
            intensity=2.7,
            cast_shadow=not self._is_plain,
            position=lamp_of(page.about),
        )
        nodes.add_light_hemisphere(
            "/light/sky", sky_color=(225, 236, 255), ground_color=(190, 180, 168), intensity=1.25
        )
        nodes.configure_fog(_FADE_FROM, _FADE_TO, color=HAZE)
        nodes.add_icosphere(
            "/sky", _SKY, color=HAZE, subdivisions=2, side="back", cast_shadow=False, receive_shadow=False
        )
        nodes.add_grid(
            "/ground",
            infinite_grid=True,
            cell_size=1.0,
            section_size=1.0,
            cell_color=(165, 168, 172),
            section_color=(165, 168, 172),
            cell_thickness=1.0,
            section_thickness=1.0,
            fade_distance=26.0,
            shadow_opacity=0.0,
            position=(0.0, 0.0, 0.002),
        )
        with page.tab(TAB):
            box = server.gui.add_checkbox(
                "Shadows", initial_value=not self._is_plain, hint="Turn off on a slow computer"
            )

        @box.on_update
        def _(_event: Any) -> None:
            key.cast_shadow = box.value
