"""Units of generated interfaces: one file a kind that includes all sources, and the commands that compile them."""

from pathlib import Path

from cellwright.middleware.ros2.packages.compiling import alias_commands, compile_command, library_command, write_units


def test_unit_includes_all_sources_of_its_kind(tmp_path: Path) -> None:
    generated, introspection = tmp_path / "generated", tmp_path / "introspection"
    for name in ("a__functions.c", "b__functions.c", "a__type_support.cpp", "a.h"):
        (generated / name).parent.mkdir(exist_ok=True)
        (generated / name).write_text("")
    introspection.mkdir()
    units = dict(write_units(generated, introspection, tmp_path / "objects"))
    assert units[tmp_path / "objects" / "types.c"] == "C"
    included = [f'#include "{generated / name}"' for name in ("a__functions.c", "b__functions.c")]
    assert (tmp_path / "objects" / "types.c").read_text().splitlines() == included
    assert (tmp_path / "objects" / "introspection.c").read_text().strip() == ""


def test_private_names_of_descriptions_differ_in_a_unit(tmp_path: Path) -> None:
    generated = tmp_path / "generated"
    generated.mkdir()
    for name in ("a", "b"):
        (generated / f"{name}__description.c").write_text("static char TEXT[3] = {0};\n")
    write_units(generated, tmp_path / "none", tmp_path / "objects")
    lines = (tmp_path / "objects" / "descriptions.c").read_text().splitlines()
    assert [line for line in lines if line.startswith("#define")] == ["#define TEXT TEXT_0", "#define TEXT TEXT_1"]
    assert lines.count("#undef TEXT") == 2


def test_commands_name_language_headers_and_libraries(tmp_path: Path) -> None:
    unit = tmp_path / "types.c"
    command = compile_command("cc", unit, "C", [tmp_path / "include"])
    assert command[:3] == ["cc", "-x", "c"]
    assert f"-I{tmp_path / 'include'}" in command
    assert command[-1] == f"{unit}.o"
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "libstd_msgs__rosidl_typesupport_c.so").touch()
    (tmp_path / "lib" / "libother.so").touch()
    linked = library_command("cc", [unit], tmp_path / "libmine.so", tmp_path)
    assert "-lstd_msgs__rosidl_typesupport_c" in linked
    assert "-lother" not in linked


def test_each_type_support_has_a_library_of_its_name(tmp_path: Path) -> None:
    commands = alias_commands("cc", "some", tmp_path / "lib" / "libmine.so")
    made = [Path(command[command.index("-o") + 1]).name for command in commands]
    supports = ("fastrtps", "introspection")
    assert made == [f"libsome__rosidl_typesupport_{support}_c.so" for support in supports]
    assert all(command[-1] == "-lmine" for command in commands)
