"""Program that starts a Ray cluster of nodes with one CPU each on this machine: `cluster.py NODES`.

It prints the address and the raylet of each node as JSON, and ends the cluster when its stdin ends.
"""

import json
import sys
from typing import Any

from ray.cluster_utils import Cluster

HEALTH = {"health_check_initial_delay_ms": 0, "health_check_period_ms": 500, "health_check_failure_threshold": 5}
"""Bounds after which a node counts as dead, much shorter than Ray's own."""


def main() -> None:
    cluster = Cluster()
    options: dict[str, Any] = {"num_cpus": 1, "include_dashboard": False}
    nodes = [cluster.add_node(_system_config=HEALTH, **options)]
    nodes += [cluster.add_node(**options) for _ in range(int(sys.argv[1]) - 1)]
    raylets = [node.all_processes["raylet"][0].process.pid for node in nodes]
    print(json.dumps({"address": cluster.address, "raylets": raylets}), flush=True)
    sys.stdin.read()
    cluster.shutdown()


if __name__ == "__main__":
    main()
