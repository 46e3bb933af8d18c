"""Compares random scenes, as Lumbre and as OpenGL draw them: python3 compare.py LUMBRE_BINARY [COUNT [FIRST_SEED]]"""

import math
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR

from fixed_function import FixedFunction
from scenes import Chance, floor, sphere, torus, write_scene

SIZE = 256


def random_scene(path, seed):
    chance = Chance(seed)
    shape = chance.choice(
        torus(48, 24),
        torus(chance.choice(5, 20, 48), 24, around=(0, math.pi)),
        torus(48, 16, across=(chance.number(0, 2), chance.number(2.5, 6))),
        sphere(64, 32),
        sphere(64, 32, bottom=chance.number(0.3, 1.8)),
    )
    kinds = [chance.choice("point", "directional", "spot") for _ in range(chance.choice(*range(1, 9)))]
    lights = []
    for kind in kinds:
        changes = {}
        if kind != "point" and chance.number(0, 1) < 0.5:
            cutoff = chance.choice(0.02, 0.1, 0.3, 0.6, 1.2, math.pi / 2, math.pi)
            changes["spot"] = {"cutoff": cutoff, "exponent": float(chance.choice(0, 0.3, 1, 2.5, 16, 127, 128))}
        if kind != "directional" and chance.number(0, 1) < 0.4:
            changes["attenuation"] = chance.choice([1, 0, 0], [0, 0.7, 0], [0, 0, 0.6], [0.01, 0, 0.5])
        if chance.number(0, 1) < 0.2:
            changes |= {"diffuse": chance.color(1, 4), "specular": chance.color(1, 4)}
        if chance.number(0, 1) < 0.1:
            changes["enabled"] = False
        lights.append(chance.light(kind, **changes))
    surfaces = []
    for _ in range(2):
        # Not 0: (n.h)^0 where n.h is 0 is nothing that OpenGL defines.
        surface = chance.surface(chance.choice(0.01, 0.5, 1, 3, 10, 32, 64, 100, 127, 128))
        if chance.number(0, 1) < 0.6:
            surface["back"] = chance.surface(chance.choice(0.5, 10, 128))
        surfaces.append(surface)
    settings = {
        "ambient": chance.color(0, 0.25),
        "background": chance.color(0, 0.3),
        "localViewer": chance.choice(True, False),
        "twoSided": chance.choice(True, False),
    }
    if chance.number(0, 1) < 0.4:
        numbers = chance.choice({"mode": "linear", "start": 2.2, "end": 6.0}, {"mode": "exp", "density": 0.3}, {"mode": "exp2"})
        settings["fog"] = {"color": chance.color(0.2, 0.6), **numbers}
    if chance.number(0, 1) < 0.15:
        settings |= {"shading": "flat", "flatRule": "last-vertex"}
    transforms = ({}, {})
    if chance.number(0, 1) < 0.4:
        turn = chance.random.normal(size=4)
        scale = [chance.number(0.5, 1.5) * chance.choice(1, 1, -1) for _ in range(3)]
        transforms = ({"rotation": (turn / np.linalg.norm(turn)).tolist(), "scale": scale}, {"scale": [1, 1, chance.choice(1, -1)]})
    double_sided = (chance.choice(True, True, False), True)
    write_scene(path, [shape, floor(24)], surfaces, lights, chance.eye(), settings, transforms, double_sided)


def one_surface(surfaces):
    """The pixels whose 3x3 neighbourhood is one surface."""
    height, width = surfaces.shape
    inside = np.zeros((height, width), bool)
    middle = surfaces[1:-1, 1:-1]
    same = [surfaces[y : y + height - 2, x : x + width - 2] == middle for y in range(3) for x in range(3)]
    inside[1:-1, 1:-1] = np.logical_and.reduce(same)
    return inside


def main():
    binary = sys.argv[1]
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    first = int(sys.argv[3]) if len(sys.argv) > 3 else 0
    opengl = FixedFunction(SIZE)
    largest, total, pixels, failed = 0.0, 0.0, 0, []
    with tempfile.TemporaryDirectory() as folder:
        scene, frame = pathlib.Path(folder, "scene.glb"), pathlib.Path(folder, "frame.exr")
        for seed in range(first, first + count):
            random_scene(scene, seed)
            options = ["--size", f"{SIZE}x{SIZE}", "--display", "clamp"]
            subprocess.run([binary, "render", scene, "-o", frame, *options], check=True, stderr=subprocess.DEVNULL)
            expected, surfaces = opengl.draw(scene)
            with OpenEXR.File(str(frame)) as file:
                got = file.channels()["RGB"].pixels
            apart = np.abs(got - expected)[one_surface(surfaces)]
            good = np.isfinite(got).all() and apart.max() <= 1 / 255 and apart.mean() <= 1e-4
            largest, total, pixels = max(largest, apart.max()), total + apart.sum(), pixels + apart.size
            failed += [] if good else [seed]
            print(f"{seed}: largest {apart.max():.2e}, mean {apart.mean():.2e}{'' if good else '  FAILED'}", flush=True)
    print(f"{count} scenes against {opengl.name}: largest {largest:.2e}, mean {total / pixels:.2e}, failed {failed}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
