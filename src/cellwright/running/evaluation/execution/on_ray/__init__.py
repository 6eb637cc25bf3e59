"""Evaluation on a Ray cluster: a Ray task for each run. Scheduling, retries and object store are Ray's."""
