"""Benchmarks of Cellwright: each figure is a ratio, or measured beside its reference in the same run."""
