"""Makes the cases of tests/frames/opengl.rs: scenes, and what OpenGL draws of them. README.md says how to run it."""

import math
import pathlib

import numpy as np
import OpenEXR

from fixed_function import FixedFunction
from scenes import Chance, floor, sphere, torus, write_scene

HERE = pathlib.Path(__file__).parent
SIZE = 64
# Colours are rounded to this, which keeps files small: at most 7.6e-6 off, where the test allows 1e-4 on average.
STEP = 2.0**-16


def one_point_light(path):
    chance = Chance(1)
    lights = [chance.light("point", at=[1.2, 1.4, 1.6], attenuation=[0.2, 0.1, 0.1])]
    settings = {"ambient": chance.color(0, 0.2), "background": chance.color(0, 0.3)}
    write_scene(path, [sphere(), floor()], [chance.surface(1), chance.surface(3)], lights, [2.6, 1.6, 1.8], settings)


def eight_lights_two_sided(path):
    chance = Chance(2)
    kinds = ("spot", "point", "directional", "spot", "point", "directional", "spot", "point")
    lights = [chance.light(kind, diffuse=chance.color(0, 0.4)) for kind in kinds]
    surfaces = [{**chance.surface(10), "back": chance.surface(32)} for _ in range(2)]
    settings = {"ambient": chance.color(0, 0.2), "background": chance.color(0, 0.3), "twoSided": True}
    half = torus(around=(0, math.pi), columns=12)
    write_scene(path, [half, floor()], surfaces, lights, [0.8, 1.5, -3.2], settings)


def infinite_viewer(path):
    chance = Chance(3)
    lights = [chance.light("directional"), chance.light("point"), chance.light("spot", spot={"cutoff": 0.7, "exponent": 8.0})]
    settings = {"background": chance.color(0, 0.3), "localViewer": False}
    write_scene(path, [torus(), floor()], [chance.surface(10), chance.surface(5)], lights, chance.eye(), settings)


def fog(mode, **numbers):
    def write(path):
        chance = Chance(["linear", "exp", "exp2"].index(mode) + 4)
        lights = [chance.light("point"), chance.light("spot"), chance.light("directional")]
        settings = {"ambient": chance.color(0, 0.2), "fog": {"mode": mode, "color": chance.color(0.2, 0.6), **numbers}}
        write_scene(path, [torus(), floor()], [chance.surface(32), chance.surface(100)], lights, chance.eye(), settings)

    return write


def transformed(path):
    """Mirrored, squeezed and turned; normals of all lengths; a highlight that a wrong normal matrix would move."""
    chance = Chance(7)
    positions, normals, triangles = torus(across=(0.3, 4.6))
    normals = normals * chance.random.uniform(0.2, 4, (len(normals), 1)).astype(np.float32)
    lights = [chance.light("point"), chance.light("directional"), chance.light("directional")]
    surfaces = [{**chance.surface(20), "back": chance.surface(4)}, chance.surface(6)]
    turn = [0.36, -0.24, 0.18, math.sqrt(1 - 0.36**2 - 0.24**2 - 0.18**2)]
    transforms = ({"rotation": turn, "scale": [-0.7, 1.5, 1.1], "translation": [0.1, 0.2, 0]}, {"scale": [-0.8, 1, 1.2]})
    settings = {"ambient": chance.color(0, 0.2), "background": chance.color(0, 0.3), "twoSided": True}
    write_scene(path, [(positions, normals, triangles), floor()], surfaces, lights, chance.eye(), settings, transforms)


def cutoffs(path):
    """Cones of 90 and 180 degrees, narrow ones, exponents 0 and 128, and a cone on a directional light."""
    chance = Chance(8)
    cones = [(math.pi, 128), (0.12, 0), (0.9, 128), (math.pi / 2, 2.5)]
    lights = [
        chance.light("spot", diffuse=chance.color(0, 0.4), spot={"cutoff": cutoff, "exponent": float(exponent)})
        for cutoff, exponent in cones
    ]
    # So low that the plane of its 90 degrees cuts the floor.
    lights.append(chance.light("spot", at=[1.3, -0.7, 0.6], spot={"cutoff": math.pi / 2, "exponent": 0.0}))
    # A directional light shines along its axis: its cone is there, and changes nothing.
    lights.append(chance.light("directional", diffuse=chance.color(0, 0.3), spot={"cutoff": 1.2, "exponent": 3.0}))
    settings = {"background": chance.color(0, 0.3)}
    surfaces = [chance.surface(2), chance.surface(16)]
    write_scene(path, [torus(), floor(12)], surfaces, lights, [1.2, 3.1, 1.4], settings)


def saturated(path):
    """Light beyond 1, clamped at the vertices; exponent 128; the light close to the floor."""
    chance = Chance(9)
    bright = {"diffuse": chance.color(1, 4), "specular": chance.color(1, 4)}
    lights = [
        chance.light("point", at=[1.1, -0.9, 0.9], attenuation=[0, 0, 1], **bright),
        chance.light("directional", **bright),
        chance.light("point", attenuation=[0, 0.8, 0], ambient=chance.color(0.2, 0.8)),
    ]
    dark = {"ambient": chance.color(0, 0.2), "diffuse": chance.color(0, 0.2)}
    surfaces = [{**chance.surface(128), **dark}, {**chance.surface(64), **dark}]
    write_scene(path, [sphere(), floor()], surfaces, lights, [2.4, 1.8, 2.2], {"background": chance.color(0, 0.3)})


def last_vertex(path):
    """GL_FLAT: a triangle has the colour of its last vertex."""
    chance = Chance(10)
    lights = [chance.light("point"), chance.light("spot", spot={"cutoff": 0.8, "exponent": 1.0})]
    settings = {"ambient": chance.color(0, 0.3), "shading": "flat", "flatRule": "last-vertex"}
    surfaces = [chance.surface(8), chance.surface(3)]
    write_scene(path, [torus(10, 6), floor(5)], surfaces, lights, chance.eye(), settings)


def exponent_0(path):
    """(n.h)^0: the highlight is a step where n.l = 0. Directional lights only: fixed_function.py says why."""
    chance = Chance(11)
    lights = [chance.light("directional", diffuse=chance.color(0, 0.5), specular=chance.color(0, 0.5)) for _ in range(2)]
    surfaces = [chance.surface(0), chance.surface(0)]
    write_scene(path, [sphere(), floor()], surfaces, lights, [1.5, 2.4, 2.4], {"background": chance.color(0, 0.3)})


def one_sided(path):
    """Backs that are not drawn, backs lit as fronts, a back with two keys only, a light that is off, keys left out."""
    chance = Chance(12)
    near = chance.light("point", at=[0.4, 1.2, 2.2], attenuation=[0, 0, 0.6])
    lights = [chance.light("point", enabled=False), near, chance.light("directional")]
    del lights[2][0]["extensions"]["LUMBRE_lights_phong"]["ambient"]
    del lights[2][0]["extensions"]["LUMBRE_lights_phong"]["diffuse"]
    lights[2][0].update(color=chance.color(), intensity=0.7)
    back = {"diffuse": chance.color(), "shininess": 3.0}
    surfaces = [{**chance.surface(12), "back": back}, chance.surface(20), chance.surface(9)]
    del surfaces[2]["ambient"]
    settings = {"ambient": chance.color(0, 0.3), "background": chance.color(0, 0.3), "twoSided": True}
    bowl = sphere(bottom=0.45 * math.pi)
    transforms = (
        {"rotation": [-0.8, 0, 0, 0.6], "scale": [0.8, 0.8, 0.8], "translation": [-0.8, 0, 0]},
        {"rotation": [-0.4, 0, 0.4, math.sqrt(0.68)], "scale": [0.8, 0.8, 0.8], "translation": [0.9, 0, 0]},
        {"rotation": [0.1, 0, 0, math.sqrt(0.99)]},
    )
    write_scene(path, [bowl, bowl, floor()], surfaces, lights, [0.5, 1.0, 3.8], settings, transforms, (True, False, False))


CASES = {
    "one_point_light": one_point_light,
    "eight_lights_two_sided": eight_lights_two_sided,
    "infinite_viewer": infinite_viewer,
    "fog_linear": fog("linear", start=2.4, end=5.5),
    "fog_exp": fog("exp", density=0.25),
    "fog_exp2": fog("exp2", density=0.22),
    "transformed": transformed,
    "cutoffs": cutoffs,
    "saturated": saturated,
    "last_vertex": last_vertex,
    "exponent_0": exponent_0,
    "one_sided": one_sided,
}


def main():
    opengl = FixedFunction(SIZE)
    for name, write in CASES.items():
        scene = HERE / f"{name}.glb"
        write(scene)
        colors, surfaces = opengl.draw(scene)
        colors = np.round(colors / STEP) * STEP
        pixels = np.dstack([colors, surfaces]).astype(np.float32)
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "comments": opengl.name}
        OpenEXR.File(header, {"RGBA": pixels}).write(str(scene.with_suffix(".exr")))
    print(f"{len(CASES)} cases drawn with {opengl.name}")


if __name__ == "__main__":
    main()
