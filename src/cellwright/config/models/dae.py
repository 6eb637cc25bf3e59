"""DAE reader: the triangles of COLLADA files, placed by the nodes of their scene, and the colours of materials.

Lengths become metres by the file's unit. Its up axis is ignored, as in RViz and Gazebo: robots are made so that their
meshes are right there. (Measured: of 12 files that have another up axis and an STL file of the same part, all 12 fit
as they are, none turned.) Textures, lines, lights and animations are not read.

A file is bounded before it is read: its elements and their depth, document types, which could reach other files, and
nodes that contain each other. What is read then costs time and memory in proportion to the file, or to the triangles.
"""

import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from typing import TypeAlias
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from cellwright.config.models.files import ModelFileError
from cellwright.config.models.model import Colour, Surface, clipped_colour

MAX_ELEMENTS = 500_000
"""Maximum number of elements of a file: a polygon may be one."""
MAX_DEPTH = 100
"""Maximum nesting of elements, and of nodes in the scene."""
MAX_VISITS = 500_000
"""Maximum number of elements in the scene; those of a node that is used twice count twice."""
MAX_COLOURS = 200
"""Maximum number of colours of a mesh."""
_AGAIN = "; export the mesh again, or convert it to STL"
_MIN_AREA_SHARE = 1e-9  # of the whole mesh
_PORTION = 1 << 16  # of a text that is split at once [characters]
_BLANK = re.compile(r"\s")
_TRANSFORMATIONS = {"matrix": 16, "translate": 3, "scale": 3, "rotate": 4}  # and their numbers
_PRIMITIVES = ("triangles", "polylist", "polygons", "trifans", "tristrips")

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
_Mesh: TypeAlias = tuple[Floats, Integers, str]  # vertices (n, 3), triangles (m, 3), symbol of their material


def read_dae(content: bytes, max_triangles: int) -> tuple[Surface, ...]:
    """Return the surfaces in a COLLADA file, one for each colour [m].

    Args:
        content: bytes of the file.
        max_triangles: maximum number of triangles, with each use of a mesh.

    Raises:
        ModelFileError: the file is invalid, or exceeds a bound.
        ValueError: a number is invalid; also IndexError and OverflowError.
    """
    root = _parsed(content)
    if root.tag != "COLLADA":
        raise ModelFileError(f"not a COLLADA file (root element <{root.tag:.40}>){_AGAIN}")
    return _Dae(root, max_triangles).surfaces()


def _parsed(content: bytes) -> ET.Element:
    """Return the root element; tags are without namespaces."""
    parser, builder = expat.ParserCreate(namespace_separator=" "), ET.TreeBuilder()
    parser.buffer_text, parser.buffer_size = True, 1 << 20
    count = depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count, depth
        count, depth = count + 1, depth + 1
        if count > MAX_ELEMENTS or depth > MAX_DEPTH:
            bound = (
                f"more than {MAX_ELEMENTS} elements"
                if count > MAX_ELEMENTS
                else f"elements nested deeper than {MAX_DEPTH}"
            )
            raise ModelFileError(f"line {parser.CurrentLineNumber}: {bound}; simplify the mesh")
        builder.start(tag.rpartition(" ")[2], attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag.rpartition(" ")[2])

    def refuse(*_: object) -> None:
        line = parser.CurrentLineNumber
        raise ModelFileError(f"line {line}: document types and entities are not supported; remove them")

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = start, end, builder.data
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise ModelFileError(f"line {error.lineno}: invalid XML ({expat.ErrorString(error.code)}){_AGAIN}") from None
    return builder.close()


class _Dae:
    def __init__(self, root: ET.Element, max_triangles: int) -> None:
        self._root = root
        self._by_id = {name: element for element in root.iter() if (name := element.get("id"))}
        # each is read once, however often it is used
        self._positions_of: dict[str, Floats] = {}
        self._meshes: dict[str, list[_Mesh]] = {}
        self._colours: dict[str, Colour | None] = {}
        self._max_triangles = max_triangles
        self._triangles = self._visits = 0

    def surfaces(self) -> tuple[Surface, ...]:
        """Return the surfaces [m], those of one colour as one, in the order of their first use."""
        found: dict[Colour | None, list[Surface]] = {}
        for surface in self._placed():
            found.setdefault(surface.colour, []).append(surface)
        if len(found) > MAX_COLOURS:
            raise ModelFileError(f"too many colours (got {len(found)}, at most {MAX_COLOURS}); simplify the mesh")
        return _without_tiny([Surface(*joined(surfaces), colour) for colour, surfaces in found.items()])

    def _placed(self) -> Iterator[Surface]:
        unit = self._root.find("asset/unit")
        scale = float(unit.get("meter", "1")) if unit is not None else 1.0
        if not (math.isfinite(scale) and scale > 0):
            raise ModelFileError(f"unit must be a length above 0 m (got {scale:g}){_AGAIN}")
        file_T_scene = np.diag([scale, scale, scale, 1.0])
        shown = self._referenced(self._root.find("scene/instance_visual_scene"), "url")
        scenes = self._root.findall("library_visual_scenes/visual_scene") if shown is None else [shown]
        for scene in scenes:
            for node in scene.findall("node"):
                yield from self._below(node, file_T_scene, 1)

    def _below(self, node: ET.Element, file_T_parent: Floats, depth: int) -> Iterator[Surface]:
        """Yield the triangles of a node and of those below it."""
        if depth > MAX_DEPTH:
            raise ModelFileError(f"nodes nested deeper than {MAX_DEPTH}, or in a loop{_AGAIN}")
        self._visit(1 + len(node))
        file_T_node = file_T_parent
        for element in node:
            if element.tag in _TRANSFORMATIONS:
                file_T_node = file_T_node @ _transformation(element)
        for element in node:
            if element.tag == "node":
                yield from self._below(element, file_T_node, depth + 1)
            elif element.tag == "instance_node" and (other := self._referenced(element, "url")) is not None:
                yield from self._below(other, file_T_node, depth + 1)
            elif element.tag == "instance_geometry":
                yield from self._instance(element, file_T_node)

    def _instance(self, element: ET.Element, file_T_mesh: Floats) -> Iterator[Surface]:
        """Yield the triangles of a mesh at its place."""
        self._visit(sum(1 for _ in element.iter()))
        name = element.get("url", "")
        if name not in self._meshes:
            geometry = self._referenced(element, "url")
            meshes = geometry.findall("mesh") if geometry is not None else []
            self._meshes[name] = [found for mesh in meshes for part in mesh if (found := self._part(part))]
        materials = {each.get("symbol", ""): each.get("target", "") for each in element.iter("instance_material")}
        is_mirrored = np.linalg.det(file_T_mesh[:3, :3]) < 0
        for vertices, triangles, symbol in self._meshes[name]:
            self._triangles += len(triangles)
            if self._triangles > self._max_triangles:
                raise ModelFileError(f"too many triangles (more than {self._max_triangles}); simplify the mesh")
            placed = vertices @ file_T_mesh[:3, :3].T + file_T_mesh[:3, 3]
            # the outside of a mirrored mesh stays outside
            faces = triangles[:, ::-1] if is_mirrored else triangles
            yield Surface(placed, faces, self._colour(materials.get(symbol, symbol)))

    def _visit(self, elements: int) -> None:
        self._visits += elements
        if self._visits > MAX_VISITS:
            raise ModelFileError(f"the scene has more than {MAX_VISITS} elements; simplify the mesh")

    def _part(self, element: ET.Element) -> _Mesh | None:
        """Return the triangles of one element of a mesh, without vertices that none uses; None if it has none."""
        if element.tag not in _PRIMITIVES:
            return None
        inputs = {each.get("semantic"): each for each in element.findall("input")}
        offsets = [int(each.get("offset", "0")) for each in element.findall("input")]
        stride = 1 + max(offsets, default=0)
        texts = [_integers(each.text) for each in element.iter("p")]
        if not any(len(each) >= stride for each in texts):
            return None
        vertex = inputs.get("VERTEX")
        if vertex is None or min(offsets) < 0:
            raise ModelFileError(f"<{element.tag}> has no vertices{_AGAIN}")
        indices = np.concatenate(texts)
        rows = indices[: len(indices) // stride * stride].reshape(-1, stride)
        corners = rows[:, int(vertex.get("offset", "0"))]
        match element.tag:
            case "triangles":
                triangles = corners[: len(corners) // 3 * 3].reshape(-1, 3)
            case "polylist":
                counts = element.find("vcount")
                triangles = _fans(corners, _integers(counts.text if counts is not None else None))
            case "tristrips":
                triangles = _strips(corners, np.array([len(each) // stride for each in texts]))
            case _:
                triangles = _fans(corners, np.array([len(each) // stride for each in texts]))
        if not len(triangles):
            return None
        vertices = self._positions(vertex.get("source", ""))
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise ModelFileError(f"a triangle refers to a missing vertex{_AGAIN}")
        used, renumbered = np.unique(triangles, return_inverse=True)
        return vertices[used], renumbered.reshape(-1, 3), element.get("material", "")

    def _positions(self, reference: str) -> Floats:
        """Return the positions (n, 3) that an input refers to, in the file's unit."""
        if reference not in self._positions_of:
            source = self._by_id.get(reference.removeprefix("#"))
            if source is not None and source.tag == "vertices":
                inputs = {each.get("semantic"): each for each in source.findall("input")}
                source = self._referenced(inputs.get("POSITION"), "source")
            array = source.find("float_array") if source is not None else None
            if source is None or array is None:
                raise ModelFileError(f"the positions {reference!r:.60} of vertices are missing{_AGAIN}")
            accessor = source.find("technique_common/accessor")
            stride = int(accessor.get("stride", "3")) if accessor is not None else 3
            numbers = _floats(array.text)
            if not 3 <= stride <= max(3, len(numbers)):
                raise ModelFileError(f"a position must have 3 numbers (got {stride}){_AGAIN}")
            self._positions_of[reference] = numbers[: len(numbers) // stride * stride].reshape(-1, stride)[:, :3]
        return self._positions_of[reference]

    def _colour(self, material: str) -> Colour | None:
        """Return the diffuse colour of a material, opaque: exporters disagree on transparency. None for a texture."""
        element = self._by_id.get(material.removeprefix("#"))
        instance = element.find("instance_effect") if element is not None else None
        name = instance.get("url", "") if instance is not None else ""
        if name not in self._colours:
            effect = self._by_id.get(name.removeprefix("#"))
            colour = effect.find(".//diffuse/color") if effect is not None else None
            numbers = _floats(colour.text if colour is not None else None).tolist()[:3]
            is_colour = len(numbers) == 3 and all(map(math.isfinite, numbers))
            self._colours[name] = clipped_colour((*numbers, 1.0)) if is_colour else None
        return self._colours[name]

    def _referenced(self, element: ET.Element | None, attribute: str) -> ET.Element | None:
        return None if element is None else self._by_id.get(element.get(attribute, "").removeprefix("#"))


def _without_tiny(surfaces: list[Surface]) -> tuple[Surface, ...]:
    """Return the surfaces; those that the engine cannot draw by themselves join the largest."""
    areas = [_area(each) for each in surfaces]
    largest = areas.index(max(areas)) if areas else 0
    smallest = _MIN_AREA_SHARE * sum(areas)
    is_tiny = [
        number != largest and (len(each.vertices) < 4 or not area > smallest)
        for number, (each, area) in enumerate(zip(surfaces, areas, strict=True))
    ]
    tiny = [each for each, is_left in zip(surfaces, is_tiny, strict=True) if is_left]
    if tiny:
        surfaces[largest] = Surface(*joined([surfaces[largest], *tiny]), surfaces[largest].colour)
    return tuple(each for each, is_left in zip(surfaces, is_tiny, strict=True) if not is_left)


def _area(surface: Surface) -> float:
    a, b, c = (surface.vertices[surface.triangles[:, corner]] for corner in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def _transformation(element: ET.Element) -> Floats:
    """Return the matrix of an element that moves its node."""
    numbers = _floats(element.text)
    if len(numbers) != _TRANSFORMATIONS[element.tag] or not np.isfinite(numbers).all():
        raise ModelFileError(f"<{element.tag}> must be {_TRANSFORMATIONS[element.tag]} finite numbers{_AGAIN}")
    found: Floats = np.eye(4)
    match element.tag:
        case "matrix":
            found = numbers.reshape(4, 4)
        case "translate":
            found[:3, 3] = numbers
        case "scale":
            found[:3, :3] = np.diag(numbers)
        case _:
            x, y, z, degrees = numbers.tolist()
            length, angle = math.hypot(x, y, z) or 1.0, math.radians(degrees)
            # Rodrigues' formula, where K turns v into axis x v
            K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / length
            found[:3, :3] += math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
    return found


def _fans(corners: Integers, counts: Integers) -> Integers:
    """Return the triangles (m, 3) of polygons with these numbers of corners, each split from its first corner."""
    first, number = _fan_numbers(corners, counts)
    return np.stack([corners[first], corners[first + number + 1], corners[first + number + 2]], axis=1)


def _strips(corners: Integers, counts: Integers) -> Integers:
    """Return the triangles (m, 3) of strips: each corner from the third on makes one with the two before it."""
    first, number = _fan_numbers(corners, counts)
    # every second one has its outside on the other side
    at, odd = first + number, number % 2
    return np.stack([corners[at + odd], corners[at + 1 - odd], corners[at + 2]], axis=1)


def _fan_numbers(corners: Integers, counts: Integers) -> tuple[Integers, Integers]:
    """Return for each triangle the index of its polygon's first corner, and its own number in the polygon, from 0."""
    if counts.min(initial=0) < 0 or counts.max(initial=0) > len(corners) or counts.sum() > len(corners):
        raise ModelFileError(f"a polygon has more corners than are there{_AGAIN}")
    triangles = np.maximum(counts - 2, 0)
    ends = np.cumsum(triangles)
    number = np.arange(int(triangles.sum())) - np.repeat(ends - triangles, triangles)
    return np.repeat(np.cumsum(counts) - counts, triangles), number


def _floats(text: str | None) -> Floats:
    portions = [np.array(list(map(float, words)), np.float64) for words in _portions(text or "")]
    return np.concatenate([np.zeros(0), *portions])


def _integers(text: str | None) -> Integers:
    portions = [np.array(list(map(int, words)), np.int64) for words in _portions(text or "")]
    return np.concatenate([np.zeros(0, np.int64), *portions])


def _portions(text: str) -> Iterator[list[str]]:
    """Yield the words of a text in portions: as words, numbers take ten times their memory."""
    start = 0
    while start < len(text):
        blank = _BLANK.search(text, min(start + _PORTION, len(text)))
        end = blank.end() if blank else len(text)
        yield text[start:end].split()
        start = end


def joined(surfaces: Sequence[Surface]) -> tuple[Floats, Integers]:
    """Return the vertices (n, 3) and triangles (m, 3) of surfaces as one mesh.

    Example:
        >>> corner = Surface(np.eye(3), np.array([[0, 1, 2]]))
        >>> joined([corner, corner])[1].tolist()
        [[0, 1, 2], [3, 4, 5]]
    """
    if len(surfaces) == 1:
        return surfaces[0].vertices, surfaces[0].triangles
    starts = np.cumsum([0, *(len(each.vertices) for each in surfaces)])
    triangles = [each.triangles + start for each, start in zip(surfaces, starts, strict=False)]
    vertices = np.concatenate([np.zeros((0, 3)), *(each.vertices for each in surfaces)])
    return vertices, np.concatenate([np.zeros((0, 3), np.int64), *triangles])
