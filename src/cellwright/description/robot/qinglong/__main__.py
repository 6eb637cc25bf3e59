"""Writes the URDF of the QingLong into the catalogue."""

from pathlib import Path

from cellwright.description.robot.qinglong.urdf import urdf_text

PATH = Path(__file__).parents[1] / "catalogue" / "qinglong" / "urdf" / "qinglong.urdf"

if __name__ == "__main__":
    PATH.write_text(urdf_text(), "utf-8")
