"""Command that writes the URDF of the QingLong into the catalogue."""

from importlib.resources import files
from pathlib import Path

from tools.qinglong.urdf import urdf_text

PATH = Path(str(files("cellwright.config.robot"))) / "catalogue" / "qinglong" / "urdf" / "qinglong.urdf"

if __name__ == "__main__":
    PATH.write_text(urdf_text(), "utf-8")
