"""Compares `lumbre trace --integrator whitted` with POV-Ray: `compare.py LUMBRE [FOLDER] [POVRAY]`. Exit status 1 where pictures differ,
where a mistake makes no difference, or where Lumbre differs from a closed form."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

import lumbre_file
import povray_file
from closed_forms import FORMS
from scenes import MISTAKES, SCENES

SIZE = (640, 480)
# POV-Ray's picture has 16 bits, and is rounded to the nearest step.
STEP = 1 / 65535
# Rounding of f32, which both compute colours in, and of half a step.
ALLOWED = 0.6 * STEP


def main():
    program = sys.argv[1]
    folder = Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp())
    other_program = sys.argv[3] if len(sys.argv) > 3 else "povray"
    folder.mkdir(parents=True, exist_ok=True)
    agree, pictures = True, {}
    for name, scene in SCENES.items():
        own = pictures[name] = ours(program, scene, folder / name, SIZE)
        other = theirs(other_program, scene, folder / name, SIZE)
        agree &= report(name, own, other)
        save(folder / f"{name}.png", own, other)
    for mistake, (name, scene) in MISTAKES.items():
        other = theirs(other_program, scene, folder / "mistake", SIZE)
        agree &= not report(f"{name} with a mistake ({mistake})", pictures[name], other)
    for form in FORMS:
        agree &= report_closed_form(program, other_program, folder, form)
    sys.exit(int(not agree))


def report(name, own, other):
    difference = np.abs(own - other)
    apart = (difference.max(-1) > ALLOWED).sum()
    root = np.sqrt((difference**2).mean())
    print(
        f"{name}: at most {difference.max():.2e} apart, root mean square {root:.2e} (rounding alone: {STEP / 2:.2e}, {STEP / 12**0.5:.2e}); "
        f"{apart} of {difference[..., 0].size} pixels beyond rounding"
    )
    return apart == 0


def report_closed_form(program, other_program, folder, form):
    """Of the pixel in the middle."""
    size = (3, 3)
    path = folder / form["name"].replace(" ", "_")
    own = ours(program, form["scene"], path, size)[1, 1]
    other = theirs(other_program, form["scene"], path, size, form["medium"])[1, 1]
    shown = lambda values: ", ".join(f"{value:.5f}" for value in values)
    print(f"{form['name']}: closed form {shown(form['radiance'])}; Lumbre {shown(own)}; POV-Ray {shown(other)}")
    return np.abs(own - form["radiance"]).max() < 1e-6


def ours(program, scene, path, size):
    source, output = path.with_suffix(".gltf"), path.with_suffix(".exr")
    lumbre_file.write(scene, source)
    command = [program, "trace", source, "-o", output, "--size", "{}x{}".format(*size), "--display", "linear", "--no-default-light"]
    quietly(command + ["--depth", scene["depth"], "--weight", 0, "--quiet"])
    channels = OpenEXR.File(str(output), separate_channels=True).channels()
    return np.stack([channels[name].pixels for name in "RGB"], -1).astype(float)


def theirs(program, scene, path, size, medium="media"):
    source, output = path.with_suffix(".pov"), path.with_suffix(".ppm")
    povray_file.write(scene, source, size, medium)
    # Linear light in 16 bits, one ray through the middle of each pixel.
    quietly([program, f"+I{source}", f"+O{output}", "+FP16", "File_Gamma=1.0", "+W{}".format(size[0]), "+H{}".format(size[1]), "-A", "-D"])
    data = output.read_bytes()
    header = re.match(rb"P6\s+(?:#.*\n)*(\d+)\s+(\d+)\s+65535\s", data)
    picture = np.frombuffer(data[header.end() :], ">u2").reshape(size[1], size[0], 3) * STEP
    assert picture.max() < 1, "brighter than POV-Ray's file can hold"
    return picture


def quietly(command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(word) for word in command)}\n{done.stderr[-2000:]}")


def save(path, own, other):
    """Ours, theirs, and a heat map of the difference: black for none, white for ten steps and more."""
    shown = lambda light: np.clip(light, 0, 1) ** (1 / 2.2)
    heat = np.clip(np.abs(own - other).max(-1, keepdims=True) / (10 * STEP), 0, 1)
    heat = np.clip(np.concatenate([3 * heat, 3 * heat - 1, 3 * heat - 2], -1), 0, 1)
    Image.fromarray((255 * np.concatenate([shown(own), shown(other), heat], 1)).astype(np.uint8)).save(path)


if __name__ == "__main__":
    main()
