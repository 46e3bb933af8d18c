"""Three scenes of mirrors and glass, and how they are written for Lumbre (.glb) and for Mitsuba (a dictionary). Metres, y up, linear RGB."""

import json
import struct

import numpy as np

WHITE, RED, GREEN = (0.7, 0.7, 0.7), (0.6, 0.1, 0.1), (0.1, 0.5, 0.15)


def matt(color):
    return {"kind": "matt", "color": color}


def mirror(weight):
    return {"kind": "mirror", "weight": weight}


def glass(ior, around=1.0):
    """`around` is the index of what the surface lies in; Lumbre finds it by itself."""
    return {"kind": "glass", "ior": ior, "around": around}


def sheet(ior):
    return {"kind": "sheet", "ior": ior}


def light(radiance):
    return {"kind": "light", "radiance": radiance}


def quad(corner, u, v, material):
    """Its front is where u x v points to."""
    return {"shape": "quad", "corner": corner, "u": u, "v": v, "material": material}


def ball(middle, radius, material):
    return {"shape": "ball", "middle": middle, "radius": radius, "material": material}


def box(middle, size, material):
    return {"shape": "box", "middle": middle, "size": size, "material": material}


def room(lamp, radiance):
    """4 x 3 x 4 m, open to the front, with a lamp of so many metres below the ceiling."""
    return [
        quad((-2, 0, 2), (4, 0, 0), (0, 0, -4), matt(WHITE)),
        quad((-2, 3, -2), (4, 0, 0), (0, 0, 4), matt(WHITE)),
        quad((-2, 0, -2), (4, 0, 0), (0, 3, 0), matt(WHITE)),
        quad((-2, 0, 2), (0, 0, -4), (0, 3, 0), matt(RED)),
        quad((2, 0, -2), (0, 0, 4), (0, 3, 0), matt(GREEN)),
        quad((-lamp / 2, 2.95, -lamp / 2), (lamp, 0, 0), (0, 0, lamp), light((radiance,) * 3)),
    ]


CAMERA = {"eye": (0.2, 1.5, 6.5), "target": (0.0, 1.3, 0.0), "fov": 34.0}

SCENES = {
    "mirrors": room(1.0, 12.0)
    + [
        ball((-0.7, 0.7, -0.4), 0.7, mirror((0.9, 0.9, 0.9))),
        quad((0.3, 0.3, -1.9), (1.5, 0, 0), (0, 2.0, 0), mirror((0.8, 0.85, 0.9))),
        ball((0.9, 0.4, 0.5), 0.4, matt((0.6, 0.5, 0.2))),
    ],
    "glass": room(1.6, 6.0)
    + [
        ball((-0.6, 0.75, 0.2), 0.7, glass(1.5)),
        box((0.9, 0.61, -0.3), (0.8, 1.2, 0.8), glass(1.33)),
    ],
    "nested": room(1.6, 6.0)
    + [
        ball((-0.7, 0.9, 0.0), 0.8, glass(1.5)),
        ball((-0.7, 0.9, 0.0), 0.5, glass(1.0, around=1.5)),
        quad((0.3, 0.01, 0.9), (1.4, 0, -0.3), (0, 1.8, 0), sheet(1.5)),
        ball((1.0, 0.5, -0.6), 0.5, mirror((0.9, 0.9, 0.9))),
    ],
}


def glb(objects, path):
    """Writes a scene for Lumbre."""
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": []}],
        "nodes": [],
        "meshes": [],
        "materials": [],
        "accessors": [],
        "bufferViews": [],
        "cameras": [{"type": "perspective", "perspective": {"yfov": np.radians(CAMERA["fov"]), "znear": 0.01}}],
        "extensionsUsed": ["LUMBRE_materials_phong", "LUMBRE_quadric"],
    }
    data = bytearray()

    def accessor(values, component, kind):
        view = {"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes}
        data.extend(values.tobytes())
        document["bufferViews"].append(view)
        found = {"bufferView": len(document["bufferViews"]) - 1, "componentType": component}
        found |= {"count": len(values), "type": kind}
        if kind == "VEC3":
            found |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        document["accessors"].append(found)
        return len(document["accessors"]) - 1

    for number, thing in enumerate(objects):
        positions, normals, indices = triangles(thing)
        primitive = {
            "attributes": {
                "POSITION": accessor(np.array(positions, np.float32), 5126, "VEC3"),
                "NORMAL": accessor(np.array(normals, np.float32), 5126, "VEC3"),
            },
            "indices": accessor(np.array(indices, np.uint32), 5125, "SCALAR"),
            "material": number,
        }
        document["meshes"].append({"primitives": [primitive]})
        kind = thing["material"]["kind"]
        document["materials"].append(
            {
                "doubleSided": kind in ("glass", "sheet"),
                "extensions": {"LUMBRE_materials_phong": phong(thing["material"])},
            }
        )
        node = {"name": f"{kind} {number}", "mesh": number}
        if thing["shape"] == "ball":
            node["translation"] = [float(value) for value in thing["middle"]]
            node["extensions"] = {"LUMBRE_quadric": {"kind": "sphere", "radius": thing["radius"]}}
        document["nodes"].append(node)
    document["nodes"].append({"name": "view", "camera": 0, "matrix": camera_matrix().T.flatten().tolist()})
    document["scenes"][0]["nodes"] = list(range(len(document["nodes"])))
    document["buffers"] = [{"byteLength": len(data)}]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", len(data), b"BIN\0") + data)


def triangles(thing):
    """Positions, normals and indices."""
    if thing["shape"] == "mesh":
        return thing["positions"], thing["normals"], thing["triangles"].ravel()
    faces = [(thing["corner"], thing["u"], thing["v"])] if thing["shape"] == "quad" else box_faces(thing)
    positions, normals, indices = [], [], []
    for corner, u, v in faces:
        corner, u, v = (np.array(value, float) for value in (corner, u, v))
        first = len(positions)
        positions += [corner, corner + u, corner + u + v, corner + v]
        normals += [np.cross(u, v) / np.linalg.norm(np.cross(u, v))] * 4
        indices += [first, first + 1, first + 2, first, first + 2, first + 3]
    return positions, normals, indices


def phong(material):
    black = {"ambient": [0, 0, 0], "diffuse": [0, 0, 0], "specular": [0, 0, 0]}
    match material["kind"]:
        case "matt":
            return black | {"diffuse": list(material["color"])}
        case "light":
            return black | {"emission": list(material["radiance"])}
        case "mirror":
            return black | {"mirror": list(material["weight"])}
        case kind:
            clear = {"transmission": [1, 1, 1], "ior": material["ior"], "fresnelSplit": True}
            return black | clear | {"thin": kind == "sheet"}


def box_faces(thing):
    """Of a box; of a ball the box around it, which is there for viewers that know no exact surfaces."""
    around = thing["shape"] == "ball"
    middle = np.zeros(3) if around else np.array(thing["middle"], float)
    half = np.full(3, thing["radius"]) if around else 0.5 * np.array(thing["size"], float)
    for axis in range(3):
        for side in (-1, 1):
            u, v, out = np.zeros(3), np.zeros(3), np.zeros(3)
            out[axis] = side * half[axis]
            u[(axis + 1) % 3] = 2 * half[(axis + 1) % 3] * side
            v[(axis + 2) % 3] = 2 * half[(axis + 2) % 3]
            yield middle + out - u / 2 - v / 2, u, v


def camera_matrix():
    eye, target = (np.array(CAMERA[key], float) for key in ("eye", "target"))
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross((0, 1, 0), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :] = np.column_stack([right, np.cross(back, right), back, eye])
    return matrix


def mitsuba(mi, objects, size):
    """The scene as Mitsuba's dictionary, for the variant that is set."""
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": -1},
        "sensor": {
            "type": "perspective",
            "fov": CAMERA["fov"],
            "fov_axis": "y",
            "to_world": mi.ScalarTransform4f().look_at(
                origin=CAMERA["eye"], target=CAMERA["target"], up=(0, 1, 0)
            ),
            "film": {
                "type": "hdrfilm",
                "width": size[0],
                "height": size[1],
                "rfilter": {"type": "box"},
                "component_format": "float32",
            },
            "sampler": {"type": "independent"},
        },
    }
    for number, thing in enumerate(objects):
        material = thing["material"]
        if thing["shape"] == "quad":
            corner, u, v = (np.array(thing[key], float) for key in ("corner", "u", "v"))
            matrix = np.eye(4)
            normal = np.cross(u, v) / np.linalg.norm(np.cross(u, v))
            matrix[:3, :] = np.column_stack([u / 2, v / 2, normal, corner + u / 2 + v / 2])
            shape = {"type": "rectangle", "to_world": mi.ScalarTransform4f(matrix)}
        elif thing["shape"] == "ball":
            shape = {"type": "sphere", "center": thing["middle"], "radius": thing["radius"]}
        else:
            matrix = np.diag([*(0.5 * np.array(thing["size"], float)), 1.0])
            matrix[:3, 3] = thing["middle"]
            shape = {"type": "cube", "to_world": mi.ScalarTransform4f(matrix)}
        rgb = lambda value: {"type": "rgb", "value": list(value)}
        match material["kind"]:
            case "matt":
                shape["bsdf"] = {"type": "diffuse", "reflectance": rgb(material["color"])}
            case "mirror":
                shape["bsdf"] = {"type": "conductor", "material": "none"}
                shape["bsdf"]["specular_reflectance"] = rgb(material["weight"])
            case "glass":
                shape["bsdf"] = {"type": "dielectric", "int_ior": material["ior"], "ext_ior": material["around"]}
            case "sheet":
                shape["bsdf"] = {"type": "thindielectric", "int_ior": material["ior"], "ext_ior": 1.0}
            case "light":
                shape["bsdf"] = {"type": "diffuse", "reflectance": rgb((0, 0, 0))}
                shape["emitter"] = {"type": "area", "radiance": rgb(material["radiance"])}
        scene[f"thing{number}"] = shape
    return scene
