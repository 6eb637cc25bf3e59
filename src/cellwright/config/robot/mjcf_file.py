"""MJCF files of robots: bounded reading with includes, compilation by the engine, and the places of elements.

The engine allocates and computes whatever a file requests, and its model no longer knows the lines. So the elements are
read here first: what could grow without limit is refused, and what is compiled afterwards finds its line by its order.
"""

import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cellwright.config.models.files import MAX_ASSET_BYTES, UNBOUNDED, ModelFileError, check_asset, mjcf_fault
from cellwright.config.models.meshes import read_mesh
from cellwright.config.parsing.sources import note_source
from cellwright.config.parsing.tree import Place, Problem, Problems, refusal, shortened
from cellwright.config.robot.meshes import MAX_TOTAL_BYTES
from cellwright.config.robot.urdf import MAX_LINKS, MAX_SHAPES
from cellwright.config.robot.urdf_file import MAX_DEPTH, MAX_ELEMENTS, Element, cleaned_text, parsed_elements
from cellwright.config.robot.urdf_numbers import MAX_COORDINATE
from cellwright.util.errors import DescriptionError
from cellwright.util.files import open_to_read

MAX_FILES = 50
"""Maximum number of files that one MJCF file includes."""
_OTHERS = {"robot": "a URDF file", "sdf": "an SDF file"}
_LINE = re.compile(r"[,\s]*Element (?:name '(?P<name>[^']*)'|'(?P<tag>\w+)')[^\n]*?line (?P<line>\d+)")
_PREFIX = re.compile(r"^(?:XML )?(?:Error: )+")
_BEFORE = re.compile(rb"^(?:\xef\xbb\xbf)?(?:\s|<\?.*?\?>|<!--.*?-->)*", re.DOTALL)
_MAX_START = 10_000  # before the first element there are comments at most [bytes]
_MESHES = (".stl", ".obj")
_OWN = ("joint", "geom", "site")
_LISTED = ("equality", "tendon", "actuator")


@dataclass(frozen=True)
class CompiledMjcf:
    """Model of the engine, and the elements that it was compiled from.

    Attributes:
        path: the MJCF file.
        model: the engine's model (`mujoco.MjModel`).
        spec: the engine's description of it (`mujoco.MjSpec`).
        name: name of the model; that of the file without its suffix by default.
        meshes: file of each mesh, by its name.
        root: the root element, with the content of included files.
        ordered: elements by kind, in the order of the model.
    """

    path: Path
    model: Any
    spec: Any
    name: str
    meshes: Mapping[str, Path]
    root: Element
    ordered: Mapping[str, list[Element]]

    def element(self, kind: str, number: int) -> Element:
        """Return the element of a body, joint, geom, site, equality, tendon or actuator, by its number in the model."""
        known = self.ordered[kind]
        counts = {"body": "nbody", "joint": "njnt", "geom": "ngeom", "site": "nsite", "equality": "neq"}
        count = getattr(self.model, counts.get(kind, {"tendon": "ntendon", "actuator": "nu"}.get(kind, "")))
        return known[number] if len(known) == count else self.root

    def kind(self, enumeration: str, number: int) -> str:
        """Return the plain name of a value: ("mjtGeom", 6) is `box`."""
        import mujoco

        return str(getattr(mujoco, enumeration)(int(number)).name).rpartition("_")[2].lower()


def is_mjcf(path: Path) -> bool:
    """Return whether a file is MJCF, by its first element."""
    try:
        with open_to_read(path) as stream:
            start = _BEFORE.sub(b"", stream.read(_MAX_START))
    except OSError:
        return False
    return start.startswith(b"<mujoco")


def compile_mjcf(path: Path) -> CompiledMjcf:
    """Return the model in an MJCF file, as the engine compiles it.

    Raises:
        DescriptionError: the file cannot be read, is refused here or by the engine; the text has the line.
    """
    problems = Problems()
    root = _read_elements(path, problems)
    if problems.errors or problems.warnings:
        # the engine reads the files itself: nothing in them may be open to two readings
        raise DescriptionError((*problems.errors, *problems.warnings))
    # only here: programs without an MJCF file do not load the engine by their configuration
    import mujoco

    handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda _text: None)
    try:
        # its warnings are about a simulation of the file as it is, which never runs
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            spec = mujoco.MjSpec.from_file(str(path))
            meshes = _checked_files(path, spec, root)
            # all bodies are links that a user may name
            spec.compiler.fusestatic = False
            model = spec.compile()
    except (ValueError, OSError, RuntimeError, mujoco.FatalError) as error:
        raise _engine_refusal(path, root, str(error)) from None
    finally:
        mujoco.set_mju_user_warning(handler)
    name = root.get("model") or path.stem
    compiled = CompiledMjcf(path, model, spec, name, meshes, root, _in_model_order(root))
    _check_coordinates(compiled)
    return compiled


def _check_coordinates(mjcf: CompiledMjcf) -> None:
    """Refuse places so far away that poses computed from them would be no numbers.

    Raises:
        DescriptionError: a body, joint, geom, site or centre of mass is one of them.
    """
    model, problems = mjcf.model, Problems()
    for kind, places in (
        ("body", model.body_pos),
        ("body", model.body_ipos),
        ("joint", model.jnt_pos),
        ("joint", model.qpos0[model.jnt_qposadr].reshape(-1, 1)),
        ("geom", model.geom_pos),
        ("site", model.site_pos),
    ):
        for number, place in enumerate(places.tolist()):
            if not all(abs(coordinate) <= MAX_COORDINATE for coordinate in place):
                shown = " ".join(f"{coordinate:g}" for coordinate in place)
                message = f"coordinates must be within ±{MAX_COORDINATE:g} [m; rad] (got {shown})"
                problems.error(mjcf.element(kind, number), message)
    if problems.errors:
        raise DescriptionError(problems.errors)


def _read_elements(path: Path, problems: Problems) -> Element:
    """Return the root element, with the content of included files in place of their `<include>`."""
    reader = _Includes(path, problems)
    root = reader.parsed(path)
    if root.tag != "mujoco":
        content = f", {_OTHERS[root.tag]}" if root.tag in _OTHERS else ""
        message = f"the root element of an MJCF file must be <mujoco> (got <{shortened(root.tag)}>{content})"
        raise refusal(path, root.place.line, message)
    return replace(root, children=reader.expanded(root, path, 0))


class _Includes:
    def __init__(self, path: Path, problems: Problems) -> None:
        self._main, self._problems = path, problems
        self._read: dict[Path, None] = {}
        self._count = 0

    def parsed(self, path: Path) -> Element:
        """Return the root element of one file."""
        self._read[path.resolve()] = None
        return parsed_elements(path, cleaned_text(path, self._problems))

    def expanded(self, parent: Element, path: Path, depth: int) -> list[Element]:
        """Return the children of an element of a file, checked, with included files in place."""
        found: list[Element] = []
        for child in parent.children:
            self._count += 1
            if self._count > MAX_ELEMENTS or depth > MAX_DEPTH:
                reason = f"nested deeper than {MAX_DEPTH}" if depth > MAX_DEPTH else f"more than {MAX_ELEMENTS}"
                raise refusal(path, child.place.line, f"elements with those of included files: {reason}")
            name = child.get("name") or child.get("joint") or child.get("file")
            element = replace(child, key=f"{child.tag}[{shortened(name)}]" if name else child.tag)
            if child.tag == "include":
                found += self._included(element, path, depth + 1)
                continue
            if child.tag in UNBOUNDED:
                message = f"<{child.tag}> is not supported; write the robot's bodies themselves"
                self._problems.error(element, message)
            elif fault := mjcf_fault(child.tag, child.attributes):
                self._problems.error(element, fault)
            found.append(replace(element, children=self.expanded(child, path, depth + 1)))
        return found

    def _included(self, element: Element, path: Path, depth: int) -> list[Element]:
        name = element.get("file") or ""
        # as the engine: from the folder of the main file, else from that of the file itself
        places = [folder / name for folder in (self._main.parent, path.parent)]
        try:
            found = next((place for place in places if name and place.is_file()), None)
        except (OSError, ValueError):
            found = None
        if found is None:
            self._problems.error(element, f"there is no file {shortened(name)!r} in {self._main.parent.absolute()}")
        elif found.resolve() in self._read:
            self._problems.error(element, "the file is included already; include each file once")
        elif len(self._read) > MAX_FILES:
            self._problems.error(element, f"more than {MAX_FILES} included files; is this a robot file?")
        else:
            return self.expanded(self.parsed(found), found, depth)
        return []


def _checked_files(path: Path, spec: Any, root: Element) -> dict[str, Path]:
    """Check what the engine would allocate and read for the model; return the files of its meshes.

    Raises:
        DescriptionError: there is too much of it, or a file cannot be used.
    """
    for kind, count, limit in (
        ("bodies", len(spec.bodies) - 1, MAX_LINKS),
        ("joints", len(spec.joints), MAX_LINKS),
        ("sites", len(spec.sites), MAX_LINKS),
        ("geoms", len(spec.geoms), MAX_SHAPES),
    ):
        if count > limit:
            raise refusal(path, 0, f"too many {kind} (got {count}, at most {limit})")
    problems = Problems()
    files = _Files(path, spec, root, problems)
    for texture in spec.textures:
        for name in (texture.file, *texture.cubefiles):
            if name:
                files.check("texture", name, spec.texturedir or spec.compiler.texturedir, _check_texture)
    folder = spec.meshdir or spec.compiler.meshdir
    meshes = {mesh.name: files.check("mesh", mesh.file, folder, _check_mesh) for mesh in spec.meshes}
    if problems.errors:
        raise DescriptionError(problems.errors)
    return meshes


class _Files:
    def __init__(self, path: Path, spec: Any, root: Element, problems: Problems) -> None:
        self._folder, self._strips_path, self._problems = path.parent, bool(spec.strippath), problems
        self._elements: dict[str, Element] = {}
        for element in _walk(root):
            for name, value in element.attributes.items():
                if name.startswith("file"):
                    self._elements.setdefault(value, element)
        self._root = root
        self._bytes: dict[Path, int] = {}

    def check(self, tag: str, name: str, folder: str, check: Callable[[Path], None]) -> Path:
        """Return the path of a file after its check; faults are reported."""
        element = self._elements.get(name, self._root)
        if not name:
            self._problems.error(element, f"a <{tag}> must be in a file (got vertices in the MJCF file)")
            return self._folder
        written = Path(name).name if self._strips_path else name
        path = self._folder / folder / written
        try:
            if not path.is_file():
                raise ModelFileError("there is no such file")
            size = path.stat().st_size
            self._bytes[path] = size
            if size > MAX_ASSET_BYTES or sum(self._bytes.values()) > MAX_TOTAL_BYTES:
                limit = f"{MAX_ASSET_BYTES >> 20} MiB, all files together {MAX_TOTAL_BYTES >> 20} MiB"
                raise ModelFileError(f"too large; a file may have {limit}")
            check(path)
        except ModelFileError as error:
            self._problems.error(element, f"{path}: {str(error).removeprefix(f'{path}: ')}")
        except (OSError, ValueError) as error:
            self._problems.error(element, f"{shortened(name)!r} cannot be read: {error}")
        return path


def _check_mesh(path: Path) -> None:
    if path.suffix.lower() not in _MESHES:
        raise ModelFileError(f"must be one of {', '.join(_MESHES)}; convert the mesh")
    read_mesh(path)


def _check_texture(path: Path) -> None:
    check_asset(path)
    note_source(path)


def _walk(element: Element) -> Iterator[Element]:
    ahead = [element]
    while ahead:
        element = ahead.pop()
        yield element
        ahead += reversed(element.children)


def _engine_refusal(path: Path, root: Element, text: str) -> DescriptionError:
    """Return the engine's error as one of the file, with the line of the element that it names."""
    text = _PREFIX.sub("", text.strip())
    found = _LINE.search(text)
    if found is None:
        return refusal(path, 0, f"the engine refuses the file: {' '.join(text.split())}")
    line, name, tag = int(found["line"]), found["name"], found["tag"]
    elements = list(_walk(root))
    here = [each for each in elements if line and each.place == Place(0, str(path), line)]
    # of an included file the engine gives no line
    fitting = [each for each in here or elements if (each.get("name") == name if name else each.tag == tag)]
    element = fitting[0] if fitting and (name or here) else here[0] if len(here) == 1 else None
    place = element.place if element else Place(0, str(path), line)
    key = element.key if element else tag or ""
    return DescriptionError([Problem(place, key, f"the engine refuses it: {' '.join(text[: found.start()].split())}")])


def _in_model_order(root: Element) -> dict[str, list[Element]]:
    """Return the elements by kind, in the order of the engine's model: bodies depth first, the world before them."""
    found: dict[str, list[Element]] = {kind: [] for kind in ("body", *_OWN, *_LISTED)}
    for section in root.children:
        if section.tag in _LISTED:
            found[section.tag] += section.children
    worlds = root.all("worldbody")
    ahead = [replace(root, children=[child for world in worlds for child in world.children])]
    while ahead:
        body = ahead.pop()
        found["body"].append(body)
        below: list[Element] = []
        for element in _within_frames(body):
            if element.tag == "body":
                below.append(element)
            elif element.tag in (*_OWN, "freejoint"):
                found["joint" if element.tag == "freejoint" else element.tag].append(element)
        ahead += reversed(below)
    return found


def _within_frames(parent: Element) -> Iterator[Element]:
    """Yield the children of a body; `<frame>` only places them."""
    for child in parent.children:
        if child.tag == "frame":
            yield from _within_frames(child)
        else:
            yield child
