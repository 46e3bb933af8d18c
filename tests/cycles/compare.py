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
from scenes import CAMERA, SCENES, box_faces, camera_matrix, glb

SIZE = (240, 180)
# Standard errors of the mean by which two pictures' brightness may differ.
SIGMAS = 4.0
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
    command = [program, "trace", scene, "-o", output, "--size", "{}x{}".format(*SIZE), "--display", "linear", "--no-default-light"]
    command += ["--integrator", "path", "--samples", samples, "--seed", seed, "--threads", 2, "--quiet"]
    before = seconds_of(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in command], check=True)
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
    mean = np.mean(parts, axis=0)
    error = np.sqrt(np.var(parts, axis=0, ddof=1).mean() / PARTS) / mean.mean()
    return mean, error, seconds


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
        own, own_error, own_seconds = measured(lambda count, seed: ours(program, path, folder, count, seed), samples)
        scene = load(objects, CAMERA, camera_matrix(), SIZE, box_faces)
        other, error, seconds = measured(lambda count, seed: theirs(scene, folder, count, seed), samples)
        both = np.hypot(own_error, error)
        difference = np.sqrt(((own - other) ** 2).mean()) / other.mean()
        bias = own.mean() / other.mean() - 1.0
        # Of the mean over pixels, whose three channels go together.
        of_mean = both / np.sqrt(SIZE[0] * SIZE[1])
        agrees = abs(bias) < SIGMAS * of_mean and difference < 1.5 * both
        apart |= not agrees
        print(
            f"{name}: lumbre {100 * own_error:.2f} % of noise in {own_seconds:.1f} s of processors, Cycles {100 * error:.2f} % in "
            f"{seconds:.1f} s, {samples} samples; apart by {100 * difference:.2f} %, by noise alone {100 * both:.2f} %; "
            f"bias {100 * bias:+.3f} %, its standard error {100 * of_mean:.3f} %; "
            f"equal-error time of ours over theirs {own_seconds * own_error**2 / (seconds * error**2):.2f}{'' if agrees else '; APART'}",
            flush=True,
        )
        save(folder / f"{name}.npz", own, other)
    sys.exit(int(apart))


def save(path, own, other):
    np.savez_compressed(path, ours=own, theirs=other)


if __name__ == "__main__":
    main()
