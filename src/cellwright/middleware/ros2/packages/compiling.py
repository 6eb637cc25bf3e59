"""Compiling of generated interfaces: one library with all types of a wheel, and a small module of each package.

Sources of a kind are compiled as one, since reading their headers takes most of the time. C++ is optimised, as it reads
and writes the messages. The C code calls Python's functions, and gains nothing measurable from it.
"""

from __future__ import annotations

import re
import sysconfig
from collections.abc import Iterator, Sequence
from pathlib import Path

from cellwright.middleware.ros2.packages.wheel import MODULES

FLAGS = {"C": ("-x", "c", "-O0"), "C++": ("-x", "c++", "-O1")}

TYPE_SUPPORTS = ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")
"""Type supports that the middleware of the wheels asks for: of serialization, and of types that it announces."""

_COMMON = ("-DNDEBUG", "-fPIC", "-pipe", "-w")
_RUN_TIME = ("rosidl_runtime_c", "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_fastrtps_cpp")
_RUN_TIME_MORE = ("rosidl_typesupport_introspection_c", "rosidl_typesupport_c", "rmw", "rcutils", "fastcdr")
_OF_PACKAGES = re.compile(
    r"lib(\w+__rosidl_(?:generator_c|generator_py|typesupport_c|typesupport_fastrtps_c|typesupport_introspection_c))\.so"
)
_PRIVATE = re.compile(r"(?m)^static [^=(\n]*?(\w+)(?:\[\w*\])? =")


def write_units(generated: Path, introspection: Path, objects: Path) -> list[tuple[Path, str]]:
    """Write files that include all generated sources of a kind; return them with their language, the slowest first."""
    units = {
        ("type_support.cpp", "C++"): _included(generated, "*__type_support_c.cpp", "*__type_support.cpp"),
        ("types.c", "C"): _included(generated, "*__functions.c", "*__type_support.c", "*_s.c"),
        ("introspection.c", "C"): _included(introspection, "*.c"),
        ("descriptions.c", "C"): _descriptions(generated),
    }
    objects.mkdir(parents=True, exist_ok=True)
    for (name, _), lines in units.items():
        (objects / name).write_text("\n".join([*lines, ""]))
    return [(objects / name, language) for name, language in units]


def _included(generated: Path, *patterns: str) -> Iterator[str]:
    for path in sorted(path for pattern in patterns for path in generated.rglob(pattern)):
        yield f'#include "{path}"'


def _descriptions(generated: Path) -> Iterator[str]:
    """Yield lines that include all type descriptions, whose private names are the same in many of them."""
    for number, path in enumerate(sorted(generated.rglob("*__description.c"))):
        names = sorted(set(_PRIVATE.findall(path.read_text())))
        yield from (f"#define {name} {name}_{number}" for name in names)
        yield f'#include "{path}"'
        yield from (f"#undef {name}" for name in names)


def compile_command(compiler: str, unit: Path, language: str, folders: Sequence[Path]) -> list[str]:
    """Return the command that compiles a unit; folders have its headers."""
    headers = [f"-I{folder}" for folder in folders]
    return [compiler, *FLAGS[language], *_COMMON, *headers, "-c", str(unit), "-o", f"{unit}.o"]


def library_command(compiler: str, units: Sequence[Path], library: Path, environment: Path) -> list[str]:
    """Return the command that links compiled units to a library (`lib/libNAME.so` below a prefix)."""
    libraries = sorted(
        found[1] for path in (environment / "lib").iterdir() if (found := _OF_PACKAGES.fullmatch(path.name))
    )
    return [
        *(compiler, "-shared", "-s", "-o", str(library)),
        *(f"{unit}.o" for unit in units),
        *(f"-L{environment / 'lib'}", "-Wl,--as-needed"),
        *(f"-l{name}" for name in (*libraries, *_RUN_TIME, *_RUN_TIME_MORE)),
    ]


def alias_commands(compiler: str, package: str, library: Path) -> list[list[str]]:
    """Return the commands that make libraries of a package, by whose names ROS 2 looks for type supports.

    They are empty, and need the library, in which the symbols are found.
    """
    linked = ("-Wl,--no-as-needed", *_linked(library))
    names = [f"lib{package}__{each}.so" for each in TYPE_SUPPORTS]
    return [[compiler, "-shared", "-s", "-nostdlib", "-o", str(library.with_name(name)), *linked] for name in names]


def module_command(compiler: str, package: Path, library: Path, folders: Sequence[Path]) -> list[str]:
    """Return the command that makes the module of a generated package, through which Python finds its types."""
    name = f"{package.name}_s"
    target = library.parents[1] / MODULES / package.name / f"{name}__rosidl_typesupport_c.so"
    headers = [f"-I{folder}" for folder in folders]
    return [
        *(compiler, *FLAGS["C"], *_COMMON, *headers, "-shared", "-s", "-o", str(target)),
        *(str(package / f"_{name}.ep.rosidl_typesupport_c.c"), *_linked(library)),
    ]


def _linked(library: Path) -> tuple[str, str]:
    return f"-L{library.parent}", f"-l{library.stem.removeprefix('lib')}"


def header_folders(generated: Sequence[Path], environment: Path) -> list[Path]:
    """Return the folders with headers: generated ones, those of ROS 2 and numpy in an environment, Python's own."""
    numpy = (environment / "lib").glob("python*/site-packages/numpy/_core/include")
    of_packages = sorted(path for path in (environment / "include").iterdir() if path.is_dir())
    return [*generated, Path(sysconfig.get_paths()["include"]), *numpy, environment / "include", *of_packages]
