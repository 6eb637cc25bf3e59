"""Execution of the runs: a process for each, on this machine or on a Ray cluster, within limits."""
