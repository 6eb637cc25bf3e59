"""Program for an interpreter that has the reference packages: writes their bytes and pictures, or serves a policy.

`reference.py bytes CASES` prints the bytes of each case, `reference.py pictures CASES` the SHA-256 of each picture, and
`reference.py serve PORT` is openpi-server around a policy that answers with its observation's state.
"""

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import json_numpy
import msgpack
import msgpack_numpy
import numpy as np
from openpi_client import image_tools
from openpi_client import msgpack_numpy as openpi_arrays
from openpi_server import WebsocketPolicyServer

PACKERS = {
    "openpi": openpi_arrays.packb,
    "lebedov": lambda value: msgpack.packb(value, default=msgpack_numpy.encode),
    "json_numpy": lambda value: json_numpy.dumps(value).encode(),
}


class Echo:
    """A policy that answers with ten times its observation's state, and fails where there is none."""

    def infer(self, observation: dict[str, Any]) -> dict[str, Any]:
        state = np.asarray(observation["state"], np.float32)
        return {"actions": np.repeat(state[np.newaxis], 10, axis=0), "sum": int(observation["picture"].sum())}

    def reset(self) -> None:
        pass


def value_of(described: Any) -> Any:
    if isinstance(described, dict) and "array" in described:
        return np.array(described["array"], described["dtype"]).reshape(described["shape"])
    if isinstance(described, dict) and "scalar" in described:
        return np.dtype(described["dtype"]).type(described["scalar"])
    if isinstance(described, dict):
        return {key: value_of(each) for key, each in described.items()}
    return described


def picture_of(size: list[int], wanted: list[int]) -> str:
    row, column, channel = np.mgrid[0 : size[1], 0 : size[0], 0:3]
    source = ((column * column // 7 + 13 * row + column * row // 5 + 50 * channel) % 256).astype(np.uint8)
    return hashlib.sha256(image_tools.resize_with_pad(source, wanted[1], wanted[0]).tobytes()).hexdigest()


def main(action: str, argument: str) -> None:
    if action == "serve":
        WebsocketPolicyServer(Echo(), "127.0.0.1", int(argument), metadata={"judge": True}).serve_forever()
    for case in json.loads(Path(argument).read_text())["cases"]:
        if action == "bytes":
            print(PACKERS[case["form"]](value_of(case["value"])).hex())
        else:
            print(picture_of(case["size"], case["wanted"]))


if __name__ == "__main__":
    main(*sys.argv[1:])
