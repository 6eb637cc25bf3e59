"""Tests of digests: those that `sha256sum` prints."""

import hashlib
from pathlib import Path

from cellwright.recording.dataset.digest import sha256_of


def test_digest_of_a_file_is_that_of_its_bytes(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"abc")
    assert sha256_of(path) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


def test_digest_of_a_folder_is_that_of_the_list_of_its_files(tmp_path: Path) -> None:
    (tmp_path / "more").mkdir()
    (tmp_path / "more/b").write_bytes(b"b")
    (tmp_path / "a").write_bytes(b"a")
    listed = "".join(f"{hashlib.sha256(name[-1].encode()).hexdigest()}  {name}\n" for name in ("a", "more/b"))
    assert sha256_of(tmp_path) == hashlib.sha256(listed.encode()).hexdigest()
