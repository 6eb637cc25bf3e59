"""Packages of messages that ROS's tools do not see.

Debian has the definitions of standard messages in packages without a manifest, unless their files for C++ are there
too. Then `rosmsg show std_msgs/String` knows no such package. A manifest beside a link to the definitions is enough.
"""

from __future__ import annotations

from pathlib import Path

MANIFEST = """<?xml version="1.0"?>
<package format="2">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Stands in for the manifest of the definitions in {source}.</description>
  <maintainer email="cellwright@example.com">The Cellwright project</maintainer>
  <license>BSD</license>
</package>
"""


def unseen(share: Path) -> list[str]:
    """The packages in a folder that define messages or services and have no manifest, sorted."""
    folders = {
        path.parent for kind in ("msg", "srv") for path in share.glob(f"*/{kind}") if any(path.glob(f"*.{kind}"))
    }
    return sorted(folder.name for folder in folders if not (folder / "package.xml").exists())


def write_stubs(share: Path, packages: Path) -> list[str]:
    """Make each package of `share` that has no manifest known, in the folder `packages`; their names."""
    names = unseen(share)
    for name in names:
        stub = packages / name
        stub.mkdir(parents=True)
        (stub / "package.xml").write_text(MANIFEST.format(name=name, source=share / name), encoding="utf-8")
        for kind in ("msg", "srv"):
            if (share / name / kind).is_dir():
                (stub / kind).symlink_to(share / name / kind)
    return names
