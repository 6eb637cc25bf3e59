"""Program of mlcroissant's environment: prints the records of a description as JSON: `python records.py FILE`."""

import json
import logging
import sys
from typing import Any

import mlcroissant


class Warnings(logging.Handler):
    """Keeps what is logged."""

    lines: list[str]

    def __init__(self, level: int) -> None:
        super().__init__(level)
        self.lines = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep the text of a record."""
        self.lines.append(record.getMessage())


def main(file: str) -> int:
    """Read it, print its records, and return 1 if the reader warns."""
    warnings = Warnings(logging.WARNING)
    logging.getLogger("absl").addHandler(warnings)
    data = mlcroissant.Dataset(jsonld=file)
    found: dict[str, list[dict[str, Any]]] = {
        each.id: [{key: _text(value) for key, value in row.items()} for row in data.records(record_set=each.id)]
        for each in data.metadata.record_sets
    }
    print(json.dumps(found))
    print("\n".join(warnings.lines), file=sys.stderr)
    return int(bool(warnings.lines))


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
