"""Writes a scene for Lumbre: glTF, with exact surfaces for all but blocks."""

import base64
import json

import numpy as np

from scenes import axes


def write(scene, path):
    right, up, back = axes(scene["camera"])
    view = np.eye(4)
    view[:3, :] = np.column_stack([right, up, back, scene["camera"]["eye"]])
    lens = {"type": "perspective", "perspective": {"yfov": np.radians(scene["camera"]["fov"]), "znear": 0.01}}
    surroundings = {"ambient": scene["ambient"], "background": scene["background"], "reflection": "phong"}
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual", "LUMBRE_lights_phong", "LUMBRE_materials_phong", "LUMBRE_quadric"],
        "cameras": [lens],
        "nodes": [{"name": "view", "camera": 0, "matrix": view.T.flatten().tolist()}],
        "materials": [],
        "meshes": [],
        "extensions": {"KHR_lights_punctual": {"lights": []}},
        "scenes": [{"extensions": {"LUMBRE_scene": surroundings}}],
        "scene": 0,
    }
    add_cube(document)
    for thing in scene["things"]:
        add_thing(document, thing)
        if "bubble" in thing:
            add_thing(document, thing["bubble"])
    for light in scene["lights"]:
        add_light(document, light, scene["highlights"])
    document["scenes"][0]["nodes"] = list(range(len(document["nodes"])))
    path.write_text(json.dumps(document, indent=1))


def add_thing(document, thing):
    number = len(document["materials"])
    material = {"doubleSided": True, "extensions": {"LUMBRE_materials_phong": phong(thing["material"])}}
    document["materials"].append(material)
    node = {"name": f"{thing['shape']} {number}", "translation": thing["middle"]}
    if thing["shape"] == "block":
        cube = {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": number}
        document["meshes"].append({"primitives": [cube]})
        node |= {"scale": thing["size"], "mesh": len(document["meshes"]) - 1}
    else:
        kind = {"ball": "sphere", "hollow ball": "sphere", "floor": "plane", "column": "cylinder", "cone": "cone"}
        sizes = {key: thing[key] for key in ("radius", "height") if key in thing}
        surface = {"kind": kind[thing["shape"]], "material": number, **sizes}
        if "half" in thing:
            surface |= {"min": [-thing["half"]] * 3, "max": [thing["half"]] * 3}
        node["extensions"] = {"LUMBRE_quadric": surface}
    document["nodes"].append(node)


def phong(material):
    """The coefficients of the documents' equation."""
    if material["kind"] == "matt":
        return {
            "ambient": material["color"],
            "diffuse": material["color"],
            "specular": [material["highlight"]] * 3,
            "shininess": material["exponent"],
            "mirror": material["mirror"],
        }
    return {
        "ambient": [0, 0, 0],
        "diffuse": [0, 0, 0],
        "specular": [0, 0, 0],
        "mirror": material["mirror"],
        "transmission": material["passing"],
        "ior": material["ior"],
        "fresnelSplit": material["fresnel"],
        "attenuationColor": material["clear"],
        "attenuationDistance": 1,
    }


def add_light(document, light, highlights):
    lights = document["extensions"]["KHR_lights_punctual"]["lights"]
    specular = light["light"] if highlights else [0, 0, 0]
    same = {"diffuse": light["light"], "specular": specular, "attenuation": [1, 0, 0]}
    node = {"name": f"light {len(lights)}", "extensions": {"KHR_lights_punctual": {"light": len(lights)}}}
    if "position" in light:
        node["translation"] = light["position"]
    else:
        node["matrix"] = shining_from(light["towards"]).T.flatten().tolist()
    kind = "point" if "position" in light else "directional"
    lights.append({"type": kind, "extensions": {"LUMBRE_lights_phong": same}})
    document["nodes"].append(node)


def shining_from(towards):
    """Of a node whose light shines along its -z."""
    back = np.array(towards, float) / np.linalg.norm(towards)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([right, np.cross(back, right), back])
    return matrix


def add_cube(document):
    """Accessors of a cube from -1/2 to 1/2: 0 its positions, 1 its normals, 2 its indices."""
    positions, normals, indices = [], [], []
    for axis in range(3):
        for side in (-1, 1):
            first = len(positions)
            for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner, normal = np.zeros(3), np.zeros(3)
                normal[axis] = side
                corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3] = side / 2, side * u / 2, v / 2
                positions.append(corner)
                normals.append(normal)
            indices += [first, first + 1, first + 2, first, first + 2, first + 3]
    arrays = [np.array(positions, np.float32), np.array(normals, np.float32), np.array(indices, np.uint32)]
    data = b"".join(array.tobytes() for array in arrays)
    document |= {"accessors": [], "bufferViews": []}
    offset = 0
    for number, array in enumerate(arrays):
        document["bufferViews"].append({"buffer": 0, "byteOffset": offset, "byteLength": array.nbytes})
        offset += array.nbytes
        accessor = {"bufferView": number, "componentType": 5125, "type": "SCALAR", "count": len(array)}
        if array.ndim == 2:
            extent = {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
            accessor |= {"componentType": 5126, "type": "VEC3", **extent}
        document["accessors"].append(accessor)
    text = base64.b64encode(data).decode()
    document["buffers"] = [{"byteLength": len(data), "uri": f"data:application/octet-stream;base64,{text}"}]
