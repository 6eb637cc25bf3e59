"""Files of wheels: their tag, and packing of a prefix."""

from __future__ import annotations

import base64
import hashlib
import sys
import sysconfig
import zipfile
from pathlib import Path

MODULES = Path("lib") / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"
"""Folder of Python's modules below a prefix."""


def tag() -> str:
    """Return the tag of wheels for this Python and machine."""
    python = f"cp{sys.version_info[0]}{sys.version_info[1]}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def pack(prefix: Path, wheel: Path, name: str) -> None:
    """Write a wheel of that name with all files of a prefix, which go to the same places below an environment.

    The wheel has no times: equal contents make equal wheels.
    """
    distribution, version, *own_tag = name.removesuffix(".whl").split("-")
    contents = {}
    for path in sorted(path for path in prefix.rglob("*") if path.is_file()):
        inside = path.relative_to(prefix)
        if inside.is_relative_to(MODULES):
            contents[inside.relative_to(MODULES).as_posix()] = path.read_bytes()
        else:
            contents[f"{distribution}-{version}.data/data/{inside.as_posix()}"] = path.read_bytes()
    information = f"{distribution}-{version}.dist-info"
    metadata = f"Metadata-Version: 2.1\nName: {distribution.replace('_', '-')}\nVersion: {version}\n"
    contents[f"{information}/METADATA"] = metadata.encode()
    lines = f"Wheel-Version: 1.0\nGenerator: cellwright\nRoot-Is-Purelib: false\nTag: {'-'.join(own_tag)}\n"
    contents[f"{information}/WHEEL"] = lines.encode()
    record = [f"{path},sha256={_digest(content)},{len(content)}" for path, content in contents.items()]
    contents[f"{information}/RECORD"] = "\n".join([*record, f"{information}/RECORD,,\n"]).encode()
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for place, content in contents.items():
            archive.writestr(zipfile.ZipInfo(place), content, zipfile.ZIP_DEFLATED)


def _digest(content: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
