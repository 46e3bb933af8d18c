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

from scenes import SCENES, glb, mitsuba as described

SIZE = (240, 180)
# Standard errors of the mean by which two pictures' brightness may differ.
SIGMAS = 4.0


def ours(program, scene, folder, samples):
    """The picture, its stated standard error over its mean, seconds."""
    output = folder / "ours.exr"
    command = [program, "trace", scene, "-o", output, "--size", "{}x{}".format(*SIZE), "--display", "linear", "--no-default-light"]
    command += ["--integrator", "path", "--samples", str(samples), "--json", "--quiet"]
    told = subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE)
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
    mean = np.mean(parts, axis=0)
    error = np.sqrt(np.var(parts, axis=0, ddof=1).mean() / len(parts)) / mean.mean()
    return mean, error, seconds


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
        own, own_error, own_seconds = ours(program, scene, folder, samples)
        print(f"{name}: lumbre {100 * own_error:.2f} % of noise in {own_seconds:.1f} s, {samples} samples")
        other, error, seconds = theirs(variant, objects, samples)
        both = np.hypot(own_error, error)
        difference = np.sqrt(((own - other) ** 2).mean()) / other.mean()
        bias = own.mean() / other.mean() - 1.0
        # Of the mean over pixels, whose three channels go together.
        of_mean = both / np.sqrt(SIZE[0] * SIZE[1])
        slower = own_seconds * own_error**2 / (seconds * error**2)
        agrees = abs(bias) < SIGMAS * of_mean and difference < 1.5 * both
        apart |= not agrees
        print(
            f"  {variant}: {100 * error:.2f} % of noise in {seconds:.1f} s; "
            f"apart by {100 * difference:.2f} %, by noise alone {100 * both:.2f} %; "
            f"bias {100 * bias:+.3f} %, its standard error {100 * of_mean:.3f} %; "
            f"equal-error time of ours over theirs {slower:.2f}{'' if agrees else '; APART'}"
        )
        save(folder / f"{name}.png", own, other, both)
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
