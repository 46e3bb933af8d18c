"""Reads and writes the few parts of binary glTF that the cases use."""

import json
import struct

import numpy as np

COMPONENTS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def read_glb(path):
    """The JSON document and the binary chunk."""
    with open(path, "rb") as file:
        content = file.read()
    length = struct.unpack("<I", content[12:16])[0]
    return json.loads(content[20 : 20 + length]), content[28 + length :]


def accessor(document, data, index):
    found = document["accessors"][index]
    view = document["bufferViews"][found["bufferView"]]
    width = WIDTHS[found["type"]]
    start = view.get("byteOffset", 0) + found.get("byteOffset", 0)
    values = np.frombuffer(data, COMPONENTS[found["componentType"]], found["count"] * width, start)
    return np.ascontiguousarray(values.reshape(-1, width))


def local_matrix(node):
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.get("scale", [1, 1, 1]))
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def flattened(document):
    """Every node of the scene with its matrix to the world."""
    found = []

    def visit(index, parent):
        node = document["nodes"][index]
        place = parent @ local_matrix(node)
        found.append((node, place))
        for child in node.get("children", []):
            visit(child, place)

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, np.eye(4))
    return found


def write_glb(path, document, meshes):
    """Writes the document with these meshes: (positions, normals, triangles, index of the material)."""
    data = b""
    document |= {"bufferViews": [], "accessors": [], "meshes": []}

    def add(values, kind, component):
        nonlocal data
        packed = np.ascontiguousarray(values, COMPONENTS[component]).tobytes()
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(data), "byteLength": len(packed)})
        data += packed + b"\0" * (-len(packed) % 4)
        entry = {"bufferView": len(document["accessors"]), "componentType": component, "count": len(values), "type": kind}
        document["accessors"].append(entry)
        return entry

    for positions, normals, triangles, material in meshes:
        first = len(document["accessors"])
        bounds = {"min": positions.min(0).tolist(), "max": positions.max(0).tolist()}
        add(positions, "VEC3", 5126).update(bounds)
        add(normals, "VEC3", 5126)
        add(triangles.ravel(), "SCALAR", 5123)
        attributes = {"POSITION": first, "NORMAL": first + 1}
        document["meshes"].append(
            {"primitives": [{"attributes": attributes, "indices": first + 2, "material": material}]}
        )
    document["buffers"] = [{"byteLength": len(data)}]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data)
