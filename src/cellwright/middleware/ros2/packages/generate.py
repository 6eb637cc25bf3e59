"""Generator of the interfaces' sources; run by the path of this file under a Python that has ROS 2's generators.

Arguments: a folder with the packages' definitions in `src`, the prefix of ROS 2, and the packages, each after those
that it uses. Sources, type descriptions and modules go to `gen` in that folder, those of introspection
to `introspection`, as some have the same names. A line on stdout names each package
that is done; those of the generators begin otherwise.

The generators themselves are ROS 2's. Two of their habits took four fifths of the time, and are replaced. They read
each template again for every interface, and each interface again for every generator.
"""

from __future__ import annotations

import functools
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import em
import rosidl_pycommon
from rosidl_adapter.action import convert_action_to_idl
from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_adapter.srv import convert_srv_to_idl
from rosidl_generator_c import generate_c
from rosidl_generator_py import generate_py, generate_py_impl
from rosidl_generator_type_description import generate_type_hash
from rosidl_parser import parser
from rosidl_typesupport_c import generate_c as generate_typesupport_c
from rosidl_typesupport_fastrtps_c import generate_typesupport_fastrtps_c
from rosidl_typesupport_introspection_c import generate_c as generate_introspection

DONE = "done: "
"""Begin of a line on stdout that ends with the name of a package."""

_SERIALIZATION, _INTROSPECTION = TYPE_SUPPORTS = ("rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c")
"""Type supports that the middleware of the wheels asks for: of serialization, and of types that it announces."""

_TO_IDL = {".msg": convert_msg_to_idl, ".srv": convert_srv_to_idl, ".action": convert_action_to_idl}


def main(folder: Path, prefix: Path, packages: list[str]) -> None:
    """Generate the sources of packages."""
    _keep_what_was_read()
    described = {path.name: path for path in (prefix / "share").iterdir()}
    for package in packages:
        described[package] = folder / "gen" / package
        _generate(package, folder, prefix, described)
        print(f"{DONE}{package}", flush=True)  # noqa: T201


def _keep_what_was_read() -> None:
    """Let templates, their expressions and interfaces be read once."""
    compiled = functools.cache(compile)
    templates: dict[str, list[Any]] = {}

    def string(self: Any, text: str, locals: Any = None, dispatcher: Any = None) -> None:  # noqa: A002, ARG001
        if text not in templates:
            scanner = em.Scanner(self.config, self.getContext(), self.currents, text)
            tokens: list[Any] = []
            try:
                tokens += iter(scanner.one, None)
            except em.TransientParseError:  # the last markup has no end: as the interpreter does, give it one
                scanner.feed(f"{self.config.prefix}\n")
                tokens += iter(scanner.one, None)
            templates[text] = tokens
        self.runSeveral(templates[text], locals)

    def evaluate(self: Any, code: str, globals: Any, locals: Any = None) -> Any:  # noqa: A002, ARG001
        return eval(compiled(code.strip(), "<template>", "eval"), globals, locals)  # noqa: S307

    def execute(self: Any, code: str, globals: Any, locals: Any = None) -> None:  # noqa: A002, ARG001
        exec(compiled(code, "<template>", "exec"), globals, locals)  # noqa: S102

    em.Interpreter.string = string
    em.Core.evaluate, em.Core.execute = evaluate, execute

    parse = parser.parse_idl_file
    parsed: dict[Path, Any] = {}

    def parse_once(locator: Any, png_file: str | None = None) -> Any:
        path = locator.get_absolute_path()
        if path not in parsed:
            parsed[path] = parse(locator, png_file)
        return parsed[path]

    for module in (rosidl_pycommon, generate_py_impl, sys.modules[generate_type_hash.__module__]):
        vars(module)["parse_idl_file"] = parse_once


def describe(package: str, folder: Path, prefix: Path, described: dict[str, Path]) -> Callable[..., str]:
    """Write the type descriptions of a package, which may use those of others; return a function for generators.

    That writes the arguments of a generator, and returns the path of their file.
    """
    source, out = folder / "src" / package, folder / "gen" / package
    paths = [path.relative_to(source) for path in sorted(source.glob("*/*"))]
    for path in paths:
        _TO_IDL[path.suffix](source, package, path, out / path.parent)
    common = {
        "package_name": package,
        "output_dir": str(out),
        "idl_tuples": [f"{out}:{path.with_suffix('.idl').as_posix()}" for path in paths],
        "target_dependencies": [],
    }
    file = folder / "arguments.json"

    def arguments(generator: str, **more: Any) -> str:
        file.write_text(json.dumps(common | {"template_dir": str(prefix / "share" / generator / "resource")} | more))
        return str(file)

    places = [f"{name}:{place}" for name, place in described.items()]
    generate_type_hash(arguments("rosidl_generator_type_description", include_paths=places))
    return arguments


def _generate(package: str, folder: Path, prefix: Path, described: dict[str, Path]) -> None:
    """Generate the sources of a package."""
    arguments = describe(package, folder, prefix, described)
    source, out = folder / "src" / package, folder / "gen" / package
    paths = [path.relative_to(source) for path in sorted(source.glob("*/*"))]
    descriptions = [f"{path.with_suffix('.idl')}:{out / path.with_suffix('.json')}" for path in paths]
    texts = [str(source / path) for path in paths]
    generate_c(arguments("rosidl_generator_c", type_description_tuples=descriptions, ros_interface_files=texts))
    generate_typesupport_fastrtps_c(arguments(_SERIALIZATION))
    introspection = folder / "introspection" / package
    generate_introspection(arguments(_INTROSPECTION, output_dir=str(introspection)))
    generate_typesupport_c(arguments("rosidl_typesupport_c"), [*TYPE_SUPPORTS])
    generate_py(arguments("rosidl_generator_py"), ["rosidl_typesupport_c"])
    (out / "__init__.py").touch()
    for generator, place in (("rosidl_generator_c", out), (_SERIALIZATION, out), (_INTROSPECTION, introspection)):
        name = f"{generator}__visibility_control.h"
        text = (prefix / "share" / generator / "resource" / f"{name}.in").read_text()
        for mark, own in (("@PROJECT_NAME@", package), ("@PROJECT_NAME_UPPER@", package.upper())):
            text = text.replace(mark, own)
        (place / "msg").mkdir(parents=True, exist_ok=True)
        (place / "msg" / name).write_text(text)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
