"""Wheels as pip reads them: files in their places, and a record that is true of each."""

import base64
import csv
import hashlib
import io
import zipfile
from pathlib import Path

from cellwright.middleware.ros2.packages.wheel import MODULES, pack, tag

NAME = f"some_interfaces-1.0-{tag()}.whl"


def packed(folder: Path) -> Path:
    prefix = folder / "prefix"
    for place, text in ((MODULES / "some" / "__init__.py", "x = 1\n"), (Path("share") / "some" / "A.msg", "bool a\n")):
        (prefix / place).parent.mkdir(parents=True, exist_ok=True)
        (prefix / place).write_text(text)
    pack(prefix, folder / NAME, NAME)
    return folder / NAME


def test_modules_are_at_the_root_and_other_files_are_data(tmp_path: Path) -> None:
    with zipfile.ZipFile(packed(tmp_path)) as wheel:
        assert wheel.read("some/__init__.py") == b"x = 1\n"
        assert wheel.read("some_interfaces-1.0.data/data/share/some/A.msg") == b"bool a\n"
        assert b"\nName: some-interfaces\n" in wheel.read("some_interfaces-1.0.dist-info/METADATA")
        assert f"Tag: {tag()}\n".encode() in wheel.read("some_interfaces-1.0.dist-info/WHEEL")


def test_record_has_length_and_digest_of_each_file(tmp_path: Path) -> None:
    with zipfile.ZipFile(packed(tmp_path)) as wheel:
        rows = list(csv.reader(io.StringIO(wheel.read("some_interfaces-1.0.dist-info/RECORD").decode())))
        assert sorted(row[0] for row in rows if row) == sorted(wheel.namelist())
        for path, digest, length in rows[:-1]:
            content = wheel.read(path)
            found = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            assert (digest, int(length)) == (f"sha256={found}", len(content))


def test_equal_contents_make_equal_wheels(tmp_path: Path) -> None:
    wheels = [packed(tmp_path / name).read_bytes() for name in ("one", "other")]
    assert wheels[0] == wheels[1]
