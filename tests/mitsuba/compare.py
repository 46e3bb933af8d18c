"""Compares `lumbre trace --integrator path` with Mitsuba 3: `compare.py LUMBRE [SAMPLES] [FOLDER] [VARIANT]`. Exit status 1 where they differ by
more than noise."""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import mitsuba
import numpy as np

from judgement import SIZE, command, judged, noise
from scenes import SCENES, glb, mitsuba as described


def ours(program, scene, folder, samples):
    """The picture, its stated standard error over its mean, seconds."""
    output = folder / "ours.exr"
    told = subprocess.run(command(program, scene, output, samples) + ["--json"], check=True, stdout=subprocess.PIPE)
    report = json.loads(told.stdout)
    picture = np.array(mitsuba.Bitmap(str(output)).convert(mitsuba.Bitmap.PixelFormat.RGB))
    return picture.astype(float), report["standard_error"], report["seconds"]


def theirs(variant, objects, samples):
    """The same of Mitsuba: its error is that of the mean of four pictures, by how much they differ."""
    mitsuba.set_variant(variant)
    scene = mitsuba.load_dict(described(mitsuba, objects, SIZE))
    # What is compiled at the first picture is not the renderer's speed.
    np.array(mitsuba.render(scene, spp=1, seed=99))
    parts, seconds = [], 0.0
    for seed in range(4):
        started = time.perf_counter()
        part = np.array(mitsuba.render(scene, spp=max(samples // 4, 1), seed=seed), dtype=float)
        seconds += time.perf_counter() - started
        parts.append(part[..., :3])
    return *noise(parts), seconds


def main():
    program = sys.argv[1]
    samples = int(sys.argv[2]) if len(sys.argv) > 2 else 1024
    folder = Path(sys.argv[3] if len(sys.argv) > 3 else tempfile.mkdtemp())
    folder.mkdir(exist_ok=True)
    # Compiled by LLVM it is said to be quicker, and ends this process where LLVM is older than it likes.
    variant = sys.argv[4] if len(sys.argv) > 4 else "scalar_rgb"
    mitsuba.set_variant(variant)
    apart = False
    for name, objects in SCENES.items():
        scene = folder / f"{name}.glb"
        glb(objects, scene)
        own = ours(program, scene, folder, samples)
        other = theirs(variant, objects, samples)
        agrees, both, words = judged(own, other)
        apart |= not agrees
        print(f"{name}, {samples} samples, against {variant}: {words}", flush=True)
        save(folder / f"{name}.png", own[0], other[0], both)
    sys.exit(int(apart))


def save(path, own, other, both):
    """Ours, theirs, and the difference: grey where there is none, a tenth of full scale to one standard error of the mean pixel."""
    shown = lambda light: np.clip(light, 0, 1) ** (1 / 2.2)
    difference = 0.5 + 0.1 * (own - other) / (both * other.mean())
    picture = np.concatenate([shown(own), shown(other), np.clip(difference, 0, 1)], axis=1)
    bitmap = mitsuba.Bitmap((255 * picture).astype(np.uint8))
    bitmap.set_srgb_gamma(True)
    bitmap.write(str(path))


if __name__ == "__main__":
    main()
