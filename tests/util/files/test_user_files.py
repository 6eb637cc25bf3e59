"""Files that are brought up to date, and the user's folders."""

import os
from pathlib import Path

from cellwright.util.files import update_file, user_folder


def test_update_file_makes_program_executable_again(tmp_path: Path) -> None:
    program = tmp_path / "program"
    update_file(program, b"#!/bin/sh\n")
    program.chmod(0o644)
    update_file(program, b"#!/bin/sh\n")
    assert os.access(program, os.X_OK)


def test_update_file_keeps_changed_file_with_tilde(tmp_path: Path) -> None:
    file = tmp_path / "folder" / "file"
    update_file(file, b"first")
    update_file(file, b"second")
    assert file.read_bytes() == b"second"
    assert file.with_name("file~").read_bytes() == b"first"


def test_user_folder_ignores_relative_path() -> None:
    at_home = Path.home() / ".cache" / "cellwright"
    assert user_folder("XDG_CACHE_HOME", ".cache", {"XDG_CACHE_HOME": "/big"}) == Path("/big/cellwright")
    assert user_folder("XDG_CACHE_HOME", ".cache", {"XDG_CACHE_HOME": "here"}) == at_home
    assert user_folder("XDG_CACHE_HOME", ".cache", {}) == at_home
