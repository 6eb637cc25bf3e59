"""Fuzzing of everything that Cellwright reads from files: `python -m fuzz`, or `make fuzz`.

It is no part of the product, and not shipped with it. Each target in `fuzz/targets` gives bytes to a reader of the
product. Bytes with any outcome but a result or a plain refusal are a finding.
"""
