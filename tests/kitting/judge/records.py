"""Program of mlcroissant's environment: prints the records of a description as JSON: `python records.py FILE`."""

import json
import logging
import sys
from typing import Any

import mlcroissant


def main(file: str) -> int:
    """Read it, print its records, and return 1 if the reader warns."""
    warnings: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: warnings.append(record.getMessage())  # type: ignore[method-assign] # a list is enough
    logging.getLogger().addHandler(handler)
    logging.getLogger("absl").addHandler(handler)
    data = mlcroissant.Dataset(jsonld=file)
    found: dict[str, list[dict[str, Any]]] = {
        each.id: [{key: _text(value) for key, value in row.items()} for row in data.records(record_set=each.id)]
        for each in data.metadata.record_sets
    }
    print(json.dumps(found))
    print("\n".join(warnings), file=sys.stderr)
    return int(bool(warnings))


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
