"""Description of the data in Croissant: all required keys, true digests, and fields that the file has."""

import csv
import hashlib
import json
import re
from typing import Any

import pytest

from kitting.benchmark import NAME, ROOT, VERSION
from kitting.croissant import CONFORMS, FILE, REQUIRED, RESPONSIBLE

DESCRIBED: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))


@pytest.mark.parametrize("key", [*REQUIRED, *RESPONSIBLE])
def test_required_key_has_a_value(key: str) -> None:
    assert DESCRIBED[key] not in ("", None, [])


def test_identity_is_that_of_the_benchmark() -> None:
    assert (DESCRIBED["name"], DESCRIBED["version"]) == (NAME, VERSION)
    assert DESCRIBED["dct:conformsTo"] == list(CONFORMS)
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", DESCRIBED["datePublished"])
    assert DESCRIBED["license"].startswith("https://spdx.org/licenses/Apache-2.0")
    assert 'license = "Apache-2.0"' in (ROOT.parent / "pyproject.toml").read_text(encoding="utf-8")


def test_generated_data_say_so_and_by_what() -> None:
    assert DESCRIBED["rai:hasSyntheticData"] is True
    assert DESCRIBED["rai:personalSensitiveInformation"].startswith("none")
    made = DESCRIBED["prov:wasGeneratedBy"]
    assert made["@type"] == "prov:Activity"
    assert "python -m kitting demonstrate" in made["prov:label"]


def test_each_file_is_there_with_its_digest_and_no_other_of_the_data() -> None:
    found = {each["contentUrl"]: each for each in DESCRIBED["distribution"]}
    files = [path for folder in ("tasks", "seeds", "clone/networks") for path in (ROOT / folder).iterdir()]
    assert found.keys() == {path.relative_to(ROOT).as_posix() for path in [*files, ROOT / "results" / "baselines.csv"]}
    for place, each in found.items():
        assert each["sha256"] == hashlib.sha256((ROOT / place).read_bytes()).hexdigest()
        assert each["@id"] == place


def test_fields_are_the_columns_of_the_file_and_their_values_are_of_the_type() -> None:
    (records,) = DESCRIBED["recordSet"]
    place = records["field"][0]["source"]["fileObject"]["@id"]
    with (ROOT / place).open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [field["name"] for field in records["field"]] == list(rows[0])
    readers = {"sc:Text": str, "sc:Integer": int, "sc:Float": float, "sc:Boolean": {"True": True, "False": False}.get}
    for field in records["field"]:
        read: Any = readers[field["dataType"]]
        assert field["source"]["extract"] == {"column": field["name"]}
        assert all(read(row[field["name"]]) is not None for row in rows)


def test_each_prefix_of_a_key_is_in_the_context() -> None:
    keys = set(
        re.findall(r'"(\w+):\w+"', json.dumps({key: each for key, each in DESCRIBED.items() if key != "@context"}))
    )
    assert keys - {"http"} <= DESCRIBED["@context"].keys()
