"""Builds the GLB of a robot with a box for each link (https://registry.khronos.org/glTF/specs/2.0) without CAD."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from itertools import product
from typing import Any

import numpy as np

FLOAT, UINT16 = 5126, 5123


def boxes_glb(sizes: Mapping[str, tuple[float, float, float]]) -> bytes:
    """Return a GLB with a box of the given size in metres for each link.

    All nodes are children of the first and displaced, as the web UI takes the poses from description and transforms.
    """
    corners = np.array(list(product((-0.5, 0.5), repeat=3)), np.float32)
    faces = np.array(
        [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4]
    )
    faces = np.concatenate([faces, [1, 5, 7, 1, 7, 3]]).astype("<u2")
    body = corners.tobytes() + faces.tobytes()
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"name": name, "mesh": 0, "scale": list(size), "translation": [9, 9, 9]}
            for name, size in sizes.items()
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(body)}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 96},
            {"buffer": 0, "byteOffset": 96, "byteLength": 72},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": FLOAT, "count": 8, "type": "VEC3"}
            | {"min": [-0.5] * 3, "max": [0.5] * 3},
            {"bufferView": 1, "componentType": UINT16, "count": 36, "type": "SCALAR"},
        ],
    }
    document["nodes"][0]["children"] = list(range(1, len(sizes)))
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
