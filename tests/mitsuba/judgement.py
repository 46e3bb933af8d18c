"""What is asked of every renderer that paths are compared with: by how much pictures may differ, and what is told of them."""

import numpy as np

SIZE = (240, 180)
# Standard errors of the mean by which two pictures' brightness may differ.
SIGMAS = 4.0


def command(program, scene, output, samples):
    """How Lumbre draws a scene."""
    words = [program, "trace", scene, "-o", output, "--size", "{}x{}".format(*SIZE), "--display", "linear", "--no-default-light"]
    words += ["--integrator", "path", "--samples", samples, "--quiet"]
    return [str(word) for word in words]


def noise(parts):
    """The mean of pictures, and its standard error over its mean."""
    mean = np.mean(parts, axis=0)
    return mean, np.sqrt(np.var(parts, axis=0, ddof=1).mean() / len(parts)) / mean.mean()


def judged(ours, theirs):
    """Whether pictures differ by no more than noise, how far they differ by noise alone, and all of it in words; `ours` and
    `theirs` are a picture, its standard error over its mean, and the seconds that it took."""
    (own, own_error, own_seconds), (other, error, seconds) = ours, theirs
    both = np.hypot(own_error, error)
    difference = np.sqrt(((own - other) ** 2).mean()) / other.mean()
    bias = own.mean() / other.mean() - 1.0
    # Of the mean over pixels, whose three channels go together.
    of_mean = both / np.sqrt(SIZE[0] * SIZE[1])
    agrees = bool(abs(bias) < SIGMAS * of_mean and difference < 1.5 * both)
    words = (
        f"lumbre {100 * own_error:.2f} % of noise in {own_seconds:.1f} s, the other {100 * error:.2f} % in {seconds:.1f} s; "
        f"apart by {100 * difference:.2f} %, by noise alone {100 * both:.2f} %; "
        f"bias {100 * bias:+.3f} %, its standard error {100 * of_mean:.3f} %; "
        f"equal-error time of ours over theirs {own_seconds * own_error**2 / (seconds * error**2):.2f}{'' if agrees else '; APART'}"
    )
    return agrees, both, words
