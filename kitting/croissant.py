"""Description of the benchmark's data in Croissant 1.1, with the fields of responsible AI."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

from cellwright._package import VERSION as CELLWRIGHT
from kitting.benchmark import NAME, ROOT, TASKS, VERSION, Split, seeds_file
from kitting.clone.agent import PUBLISHED as NETWORKS
from kitting.clone.agent import network_file
from kitting.evaluate import RunRecord

FILE: Final = ROOT / "croissant.json"
RESULTS: Final = ROOT / "results" / "baselines.csv"
"""Runs of the baselines."""
PUBLISHED: Final = "2026-11-29"
URL: Final = "README.md"
"""Address of the card, from this file: who publishes the benchmark puts its public address before all addresses."""
LICENCE: Final = "https://spdx.org/licenses/Apache-2.0.html"
DESCRIPTION: Final = (
    "Eight tasks of a robot arm with a suction cup that builds kits, in the simulator Cellwright: their cells, their "
    "seeds for training and test, the command that makes the demonstrations, and the runs of baselines."
)
CONFORMS: Final = ("http://mlcommons.org/croissant/1.1", "http://mlcommons.org/croissant/RAI/1.0")
REQUIRED: Final = (
    "@context",
    "@type",
    "dct:conformsTo",
    "name",
    "description",
    "license",
    "url",
    "creator",
    "datePublished",
    "distribution",
)
"""Keys that Croissant 1.1 requires."""
RESPONSIBLE: Final = (
    "rai:dataLimitations",
    "rai:dataBiases",
    "rai:personalSensitiveInformation",
    "rai:dataUseCases",
    "rai:dataSocialImpact",
    "rai:hasSyntheticData",
    "prov:wasDerivedFrom",
    "prov:wasGeneratedBy",
)
"""Keys on responsible AI that reviewers of data sets ask for."""

_CONTEXT: Final = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "arrayShape": "cr:arrayShape",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "containedIn": "cr:containedIn",
    "cr": "http://mlcommons.org/croissant/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isArray": "cr:isArray",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "prov": "http://www.w3.org/ns/prov#",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
_TYPES: Final = {"str": "sc:Text", "int": "sc:Integer", "bool": "sc:Boolean", "float": "sc:Float"}
_ABOUT: Final = {
    "program": "name of the program",
    "task": "name of the task",
    "seed": "seed of the run, of the test split",
    "success": "whether the task has succeeded",
    "time": "simulation time that passed [s]",
    "wall": "wall time that the run took [s]",
    "outcome": "how the run ended",
    "error_class": "none, policy or simulation",
    "state_hash": "SHA-256 of the last state",
}


def croissant(results: Path = RESULTS) -> dict[str, Any]:
    """Return the description as JSON values.

    Args:
        results: CSV with the runs of the baselines.

    Raises:
        OSError: a file cannot be read.
    """
    return {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "dct:conformsTo": list(CONFORMS),
        "name": NAME,
        "description": DESCRIPTION,
        "license": LICENCE,
        "url": URL,
        "creator": {"@type": "sc:Organization", "name": "The Cellwright developers"},
        "datePublished": PUBLISHED,
        "version": VERSION,
        "keywords": ["robotics", "manipulation", "kit building", "simulation", "benchmark"],
        "inLanguage": "en",
        "isLiveDataset": False,
        "citeAs": f"The Cellwright developers: {NAME} {VERSION}, {PUBLISHED[:4]}",
        "distribution": [*map(_file_object, files(results))],
        "recordSet": [_record_set(results)],
        "rai:dataLimitations": (
            "Simulation alone: the suction cup holds what it touches, nothing slips in it, and light does not change. "
            "No result says anything of a real cell, or of its safety."
        ),
        "rai:dataBiases": (
            "All demonstrations are of one program, with styles and mistakes drawn by the seed; none is of a person. "
            "Four part types of one competition, one arm."
        ),
        "rai:personalSensitiveInformation": "none: simulated",
        "rai:dataUseCases": "To train and compare programs that build kits. Not to argue for the safety of a machine.",
        "rai:dataSocialImpact": "Better kit building by robots replaces work of people who build kits by hand.",
        "rai:hasSyntheticData": True,
        "prov:wasDerivedFrom": "Part types and cup of the ARIAC competition of 2017, as Cellwright simulates them.",
        "prov:wasGeneratedBy": {
            "@type": "prov:Activity",
            "prov:label": "python -m kitting demonstrate; python -m kitting score",
            "prov:used": f"Cellwright {CELLWRIGHT}",
        },
    }


def files(results: Path = RESULTS) -> Iterator[Path]:
    """Yield the files that are described: of tasks, of seeds, of the clone, and the runs of the baselines."""
    yield from sorted({task.file(split) for task in TASKS for split in Split})
    yield from map(seeds_file, Split)
    yield from (network_file(task, NETWORKS) for task in TASKS)
    yield results


def _file_object(path: Path) -> dict[str, str]:
    """Return the description of a file; its address is the path from the folder of the benchmark."""
    kinds = {".yaml": "application/yaml", ".txt": "text/plain", ".csv": "text/csv", ".npz": "application/zip"}
    place = path.relative_to(ROOT).as_posix()
    return {
        "@type": "cr:FileObject",
        "@id": place,
        "name": path.name,
        "contentUrl": place,
        "encodingFormat": kinds[path.suffix],
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }


def _record_set(results: Path) -> dict[str, Any]:
    place = results.relative_to(ROOT).as_posix()
    kinds = {"program": "str", **{each.name: str(each.type) for each in fields(RunRecord)}}
    return {
        "@type": "cr:RecordSet",
        "@id": "runs",
        "name": "runs",
        "description": "a row for each run of a baseline",
        "key": [{"@id": f"runs/{name}"} for name in ("program", "task", "seed")],
        "field": [
            {
                "@type": "cr:Field",
                "@id": f"runs/{name}",
                "name": name,
                "description": _ABOUT[name],
                "dataType": _TYPES[kind],
                "source": {"fileObject": {"@id": place}, "extract": {"column": name}},
            }
            for name, kind in kinds.items()
        ],
    }
