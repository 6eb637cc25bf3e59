"""Judging a program in many runs: each in a process of its own, its result on disk at once, a report at the end."""
