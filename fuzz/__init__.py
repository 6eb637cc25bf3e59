"""Fuzzing of everything that Cellwright reads from files: `python -m fuzz`, or `make fuzz`.

No part of the product, and not shipped with it. Each target in `fuzz/targets` takes some bytes to a reader of the
product; a byte string for which anything but a result or a plain refusal comes back is a finding.
"""
