"""Compares `lumbre trace --integrator path` with Blender's Cycles: `compare.py LUMBRE [SAMPLES] [FOLDER]`. Exit status 1 where they differ by
more than noise."""

import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "mitsuba"))

from described import load, with_meshes
from judgement import SIZE, command, judged, noise
from scenes import CAMERA, SCENES, box_faces, camera_matrix, glb

# Pictures from whose differences an error is told.
PARTS = 4


def seconds_of(who):
    """Processor time, which other programs on the machine do not lengthen as they do the clock's."""
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def read(path):
    image = bpy.data.images.load(str(path), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    values = np.empty(4 * SIZE[0] * SIZE[1], np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    # Blender's first row is the lowest one.
    return values.reshape(SIZE[1], SIZE[0], 4)[::-1, :, :3].astype(float)


def ours(program, scene, folder, samples, seed):
    output = folder / "ours.exr"
    before = seconds_of(resource.RUSAGE_CHILDREN)
    subprocess.run(command(program, scene, output, samples) + ["--seed", str(seed), "--threads", "2"], check=True)
    return read(output), seconds_of(resource.RUSAGE_CHILDREN) - before


def theirs(scene, folder, samples, seed):
    output = folder / "theirs.exr"
    scene.cycles.samples, scene.cycles.seed = samples, seed
    scene.render.filepath = str(output)
    before = seconds_of(resource.RUSAGE_SELF)
    bpy.ops.render.render(write_still=True)
    return read(output), seconds_of(resource.RUSAGE_SELF) - before


def measured(render, samples):
    """The mean picture, its standard error over its mean, seconds without those of a picture of one sample, which are not the
    rays'."""
    render(1, 98)
    _, idle = render(1, 99)
    parts, seconds = [], 0.0
    for seed in range(PARTS):
        part, used = render(max(samples // PARTS, 2), seed)
        parts.append(part)
        seconds += used - idle
    return *noise(parts), seconds


def main():
    program = sys.argv[1]
    samples = int(sys.argv[2]) if len(sys.argv) > 2 else 1024
    folder = Path(sys.argv[3] if len(sys.argv) > 3 else tempfile.mkdtemp())
    folder.mkdir(exist_ok=True)
    apart = False
    for name, exact in SCENES.items():
        objects = with_meshes(exact)
        path = folder / f"{name}.glb"
        glb(objects, path)
        own = measured(lambda count, seed: ours(program, path, folder, count, seed), samples)
        scene = load(objects, CAMERA, camera_matrix(), SIZE, box_faces)
        other = measured(lambda count, seed: theirs(scene, folder, count, seed), samples)
        agrees, _, words = judged(own, other)
        apart |= not agrees
        print(f"{name}, {samples} samples, seconds of processors: {words}", flush=True)
        np.savez_compressed(folder / f"{name}.npz", ours=own[0], theirs=other[0])
    sys.exit(int(apart))


if __name__ == "__main__":
    main()
