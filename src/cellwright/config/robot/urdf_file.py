"""URDF files as elements with places: ROS packages, xacro expansion and tolerant XML.

A xacro file is a program: it computes, includes other files, and may never end. It runs in a process of its own, see
`xacro_program.py`.

Robot files come from many sources. The reader tolerates, with a warning, what other programs of the field tolerate:
stray control bytes, blanks before the declaration, a wrong encoding declaration. It refuses what could grow without
limit or reach out of the file (document types, entities).
"""

from __future__ import annotations

import codecs
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TypeAlias
from xml.parsers import expat
from xml.sax.saxutils import escape

from cellwright._package import FOLDER
from cellwright.config.parsing.sources import note_source, read_at_most, reason
from cellwright.config.parsing.tree import Place, Problem, Problems, refusal, shortened
from cellwright.util.files import LFS_POINTER, is_lfs_pointer, open_to_read

_MAX_MANIFEST_BYTES = 10_000  # of a package's manifest, whose name is near its start [bytes]
_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
MAX_EXPANSION_TIME = 30.0
"""Maximum time for the expansion of a file [s]."""
_DOCUMENT_TYPE = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_PROGRAM = (
    "import sys; sys.path.insert(0, sys.argv.pop(1)); from cellwright.config.robot.xacro_program import main; main()"
)
NO_ARGUMENTS: Arguments = MappingProxyType({})
MAX_BYTES = 16 << 20
"""Maximum size of a robot file [bytes]."""
MAX_ELEMENTS = 200_000
MAX_DEPTH = 50
_CONTROL_CHARACTER = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)
_NO_LINE_END = re.compile(r"[^\n]")
_DECLARATION = re.compile(r"\s*(?:<!--.*?-->\s*)*(<\?xml\s.*?\?>)", re.DOTALL)
_ENCODING = re.compile(rb"<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)[\"']")
_FROM_ENVIRONMENT = re.compile(r"\$\(optenv\s+(\w+)([^()<>\"']*)\)")  # left in by xacro's predecessors
_MAX_NAME_LENGTH = 60
Arguments: TypeAlias = Mapping[str, str]
"""Arguments of a xacro file by name, as `NAME:=VALUE` gives them."""


def package_folders(name: str, path: Path) -> Iterator[Path]:
    """Yield the folders where a package may be, the likeliest first; not all of them exist.

    First come the folders above the file at `path`: one of that name, on disk or in its `package.xml`, or a neighbour
    of one. Then come the folders in the environment variables of ROS.
    """
    for folder in path.resolve().parents:
        if folder.name == name or _declared_name(folder) == name:
            yield folder
        yield folder / name
    for entry in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry) / name
            if Path(entry).name == name:
                yield Path(entry)
    for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry) / "share" / name


def _declared_name(folder: Path) -> str | None:
    try:
        with open_to_read(folder / "package.xml") as stream:
            text = stream.read(_MAX_MANIFEST_BYTES).decode("utf-8", "replace")
    except (OSError, ValueError):
        return None
    note_source(folder / "package.xml")
    found = _NAME.search(text)
    return found[1] if found else None


def expand_xacro(path: Path, text: str, arguments: Arguments = NO_ARGUMENTS) -> str:
    """Return the URDF that a file's text expands to; `$(find PACKAGE)` needs no ROS.

    Raises:
        DescriptionError: the expansion fails or exceeds its bounds.
    """
    if found := _DOCUMENT_TYPE.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise refusal(path, line, "document types and entities are not supported; remove them")
    place = str(Path(FOLDER).parent)
    try:
        done = subprocess.run(  # noqa: S603 - our own interpreter and module
            [sys.executable, "-P", "-c", _PROGRAM, place, str(path), json.dumps(dict(arguments))],
            input=text.encode("utf-8", "replace"),
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            timeout=MAX_EXPANSION_TIME,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise refusal(path, 0, f"xacro: takes longer than {MAX_EXPANSION_TIME:g} s to expand") from None
    try:
        answer = json.loads(done.stdout)
    except ValueError:  # killed by the system, or by a library that fails badly on lack of memory
        raise refusal(path, 0, f"xacro: the process ended without a result (status {done.returncode})") from None
    if "text" in answer:
        for each in answer["files"]:
            note_source(Path(each))
        return str(answer["text"])
    raise refusal(Path(answer["path"]), int(answer["line"]), str(answer["message"]))


@dataclass(frozen=True, slots=True)
class Element:
    """Element of the file; `key` is the dotted path to it, with names in brackets; `texts` are pieces of its text."""

    tag: str
    attributes: Mapping[str, str]
    place: Place
    key: str
    children: list[Element] = field(default_factory=list, repr=False)
    texts: list[str] = field(default_factory=list, repr=False)

    def find(self, tag: str) -> Element | None:
        """Return the first child with this tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def all(self, *tags: str) -> list[Element]:
        """Return the children with these tags, in the order of the file."""
        return [child for child in self.children if child.tag in tags]

    def get(self, name: str) -> str | None:
        """Return an attribute, stripped of blanks; None if it is missing or empty."""
        return self.attributes.get(name, "").strip() or None


def read_elements(path: Path, problems: Problems, arguments: Arguments = NO_ARGUMENTS) -> Element:
    """Return the root element of a file; a xacro file is expanded first. Tolerated faults go to `problems`.

    Raises:
        DescriptionError: there is no such file, or it is no readable XML.
    """
    text, has_lines = _text(path, problems, arguments)
    return parsed_elements(path, text, has_lines=has_lines)


def read_text(path: Path, arguments: Arguments = NO_ARGUMENTS) -> str:
    """Return the text of a file for any URDF reader: with xacro expanded, and without stray bytes and declaration.

    Raises:
        DescriptionError: there is no such file, or it cannot be read.
    """
    return _text(path, Problems(), arguments)[0].strip()


def cleaned_text(path: Path, problems: Problems) -> str:
    """Return the text of a file without what XML forbids, and without its declaration; lines stay.

    Raises:
        DescriptionError: there is no such file, or it cannot be read.
    """
    text = _without_control_characters(path, _decoded(path, _content(path), problems), problems)
    text = _without_invalid_comments(path, text, problems)
    if declared := _DECLARATION.match(text):
        # its content is known already, and XML allows it at the very start only
        start, end = declared.span(1)
        text = text[:start] + _NO_LINE_END.sub(" ", declared[1]) + text[end:]
    return text


def _text(path: Path, problems: Problems, arguments: Arguments) -> tuple[str, bool]:
    """Return the text, and whether its lines are those of the file."""
    text = cleaned_text(path, problems)
    # the suffix decides: a file that is data never runs as a program
    if path.suffix.lower() == ".xacro":
        return expand_xacro(path, text, arguments), False
    if arguments:
        given = ", ".join(f"{name}:={value}" for name, value in arguments.items())
        message = f"takes no arguments (got {shortened(given)}); only files whose name ends in .xacro do"
        raise refusal(path, 0, message)

    def from_environment(match: re.Match[str]) -> str:
        return escape(os.environ.get(match[1], match[2]).strip(), {'"': "&quot;"})

    return _FROM_ENVIRONMENT.sub(from_environment, text), True


def _content(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise refusal(path, 0, "is a folder; name the URDF file in it")
        content = read_at_most(path, MAX_BYTES)
        if content is None:
            raise refusal(path, 0, f"larger than {MAX_BYTES >> 20} MiB; is this a robot file?")
    except FileNotFoundError:
        raise refusal(path, 0, "there is no such file") from None
    except (OSError, ValueError) as error:
        raise refusal(path, 0, f"cannot be read: {reason(error)}") from None
    if is_lfs_pointer(content):
        raise refusal(path, 0, LFS_POINTER)
    if not content.strip(b"\0 \t\r\n"):
        raise refusal(path, 0, "the file is empty")
    return content


def _decoded(path: Path, content: bytes, problems: Problems) -> str:
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode("utf-16", errors="replace")
    content = content.removeprefix(codecs.BOM_UTF8)
    declared = _ENCODING.search(content[:200])
    for encoding in ("utf-8", declared[1].decode("ascii") if declared else "utf-8"):
        try:
            return content.decode(encoding)
        except (UnicodeDecodeError, LookupError, ValueError):
            continue
    problems.add(Problem(Place(0, str(path), 0), "", "not UTF-8 text; read as Latin-1", "warning"))
    return content.decode("latin-1")


def _without_control_characters(path: Path, text: str, problems: Problems) -> str:
    """Return the text with blanks in place of characters that XML forbids."""
    found = list(_CONTROL_CHARACTER.finditer(text))
    if found:
        first = found[0]
        offset, line = first.start(), text.count("\n", 0, first.start()) + 1
        more = f", and {len(found) - 1} more" if len(found) > 1 else ""
        message = f"control byte 0x{ord(first[0]):02X} (character {offset} of the file{more}); treated as a blank"
        problems.add(Problem(Place(0, str(path), line), "", message, "warning"))
    return _CONTROL_CHARACTER.sub(" ", text)


def _without_invalid_comments(path: Path, text: str, problems: Problems) -> str:
    """Return the text with blanks in place of comments that XML forbids: those with `--` inside."""
    invalid = [found for found in _COMMENT.finditer(text) if "--" in found[1] or found[1].endswith("-")]
    if not invalid:
        return text
    line = text.count("\n", 0, invalid[0].start()) + 1
    more = f" (and {len(invalid) - 1} more)" if len(invalid) > 1 else ""
    message = f"XML forbids -- inside of a comment{more}; the comment is ignored"
    problems.add(Problem(Place(0, str(path), line), "", message, "warning"))
    pieces, end = [], 0
    for found in invalid:
        pieces += [text[end : found.start()], _NO_LINE_END.sub(" ", found[0])]
        end = found.end()
    return "".join([*pieces, text[end:]])


def parsed_elements(path: Path, text: str, *, has_lines: bool = True) -> Element:
    """Return the root element of a text; without `has_lines` its lines are not those of the file.

    Raises:
        DescriptionError: it is no readable XML, or larger than any robot's.
    """
    # without a document type there are no entities, so that nothing can expand or reach other files
    parser = expat.ParserCreate("utf-8")
    top: list[Element] = []
    stack: list[Element] = []
    count = 0

    def line() -> int:
        return parser.CurrentLineNumber if has_lines else 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > MAX_ELEMENTS:
            raise refusal(path, line(), f"more than {MAX_ELEMENTS} elements; is this a robot file?")
        if len(stack) == MAX_DEPTH:
            raise refusal(path, line(), f"elements nested deeper than {MAX_DEPTH}; is this a robot file?")
        name = attributes.get("name", "").strip()[:_MAX_NAME_LENGTH]
        own = f"{tag}[{name}]" if name else tag
        key = "" if not stack else f"{stack[-1].key}.{own}" if stack[-1].key else own
        element = Element(tag, attributes, Place(0, str(path), line()), key)
        (stack[-1].children if stack else top).append(element)
        stack.append(element)

    def refuse_document_type(*_: object) -> None:
        raise refusal(path, line(), "document types and entities are not supported; remove them")

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _tag: stack.pop()
    parser.CharacterDataHandler = lambda text: stack[-1].texts.append(text) if not text.isspace() else None
    parser.StartDoctypeDeclHandler = refuse_document_type
    parser.EntityDeclHandler = refuse_document_type
    try:
        parser.Parse(text.encode("utf-8", errors="replace"), True)
    except expat.ExpatError as error:
        message = f"invalid XML: {expat.ErrorString(error.code)} (column {error.offset + 1})"
        raise refusal(path, error.lineno if has_lines else 0, message) from None
    return top[0]
