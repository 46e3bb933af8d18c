"""Scenes to draw: a shape over a floor, lights, one camera. Made from a generator of random numbers and a handful of choices."""

import math

import numpy as np

from gltf import write_glb

EXTENSIONS = ["KHR_lights_punctual", "LUMBRE_materials_phong", "LUMBRE_lights_phong", "LUMBRE_scene"]


def parametric(point, normal, columns, rows):
    """A grid of (columns + 1) x (rows + 1) vertices; `point` and `normal` take parameters from 0 to 1."""
    parameters = [(i / columns, j / rows) for i in range(columns + 1) for j in range(rows + 1)]
    positions = np.array([point(u, v) for u, v in parameters], np.float32)
    normals = np.array([normal(u, v) for u, v in parameters], np.float32)
    corners = [i * (rows + 1) + j for i in range(columns) for j in range(rows)]
    triangles = [t for a in corners for t in ((a, a + 1, a + rows + 1), (a + 1, a + rows + 2, a + rows + 1))]
    return positions, normals, np.array(triangles)


def torus(columns=24, rows=12, around=(0, 2 * math.pi), across=(0, 2 * math.pi)):
    """Its ring lies in the plane y = 0. Cut open where the angles stop short of a full turn."""
    angles = lambda u, v: (around[0] + u * (around[1] - around[0]), across[0] + v * (across[1] - across[0]))

    def normal(u, v):
        a, b = angles(u, v)
        return math.cos(b) * math.cos(a), math.sin(b), math.cos(b) * math.sin(a)

    def point(u, v):
        a, b = angles(u, v)
        return (0.8 + 0.32 * math.cos(b)) * math.cos(a), 0.32 * math.sin(b), (0.8 + 0.32 * math.cos(b)) * math.sin(a)

    return parametric(point, normal, columns, rows)


def sphere(columns=24, rows=14, bottom=0.02 * math.pi):
    """Open at the pole above, and below from `bottom` radians before the pole below."""
    angles = lambda u, v: (2 * math.pi * u, 0.02 * math.pi + v * (0.98 * math.pi - bottom))

    def point(u, v):
        a, b = angles(u, v)
        return math.sin(b) * math.sin(a), math.cos(b), math.sin(b) * math.cos(a)

    positions, normals, triangles = parametric(point, point, columns, rows)
    return positions, normals, triangles[:, ::-1] if facing_inwards(positions, triangles) else triangles


def facing_inwards(positions, triangles):
    a, b, c = (positions[triangles[:, corner]] for corner in range(3))
    return np.sum(np.cross(b - a, c - a) * (a + b + c)) < 0


def floor(cells=8):
    place = lambda u, v: (4.4 * v - 2.2, -1.05, 4.4 * u - 2.2)
    positions, normals, triangles = parametric(place, lambda u, v: (0, 1, 0), cells, cells)
    return positions, normals, triangles[:, ::-1]


def looking(eye, target):
    """The matrix of a node at `eye` whose -Z axis points at `target`, column by column."""
    backward = np.subtract(eye, target, dtype=float)
    backward /= np.linalg.norm(backward)
    right = np.cross([0, 1, 0], backward)
    right /= np.linalg.norm(right)
    columns = [(*right, 0), (*np.cross(backward, right), 0), (*backward, 0), (*eye, 1)]
    return [float(value) for column in columns for value in column]


class Chance:
    """Random colours, surfaces and lights."""

    def __init__(self, seed):
        self.random = np.random.default_rng(seed)

    def number(self, low, high):
        return float(self.random.uniform(low, high))

    def choice(self, *values):
        return values[int(self.random.integers(len(values)))]

    def color(self, low=0.0, high=1.0):
        return [self.number(low, high) for _ in range(3)]

    def surface(self, shininess):
        colors = {"ambient": self.color(0, 0.6), "diffuse": self.color(0.2), "specular": self.color(0.2)}
        return {**colors, "emission": self.color(0, 0.08), "shininess": float(shininess)}

    def light(self, kind, **changes):
        """A light and its node's matrix; `changes` are keys of LUMBRE_lights_phong, or `at` for its place."""
        around = self.number(0, 2 * math.pi)
        away = self.number(1, 2.3)
        place = changes.pop("at", [away * math.cos(around), self.number(0.6, 2), away * math.sin(around)])
        distance = [1, 0, 0] if kind == "directional" else [self.number(0.2, 1), self.number(0, 0.3), self.number(0, 0.2)]
        phong = {
            "ambient": self.color(0, 0.1),
            "diffuse": self.color(0.1, 0.9),
            "specular": self.color(0.1, 0.9),
            "attenuation": distance,
            **changes,
        }
        if kind == "spot":
            phong.setdefault("spot", {"cutoff": self.number(0.35, 1), "exponent": float(self.choice(0, 1, 8, 40, 128))})
        light = {"type": kind, "extensions": {"LUMBRE_lights_phong": phong}}
        return light, looking(place, [self.number(-0.3, 0.3), self.number(-0.5, 0.2), self.number(-0.3, 0.3)])

    def eye(self):
        around, above, away = self.number(0, 2 * math.pi), self.number(0.2, 1.1), self.number(3.2, 4)
        level = away * math.cos(above)
        return [level * math.cos(around), away * math.sin(above), level * math.sin(around)]


def write_scene(path, shapes, surfaces, lights, eye, settings, transforms=({}, {}), double_sided=(True, True)):
    """One node, mesh and material for each shape; `settings` are keys of LUMBRE_scene."""
    nodes = [{"mesh": index, **transform} for index, (_, transform) in enumerate(zip(shapes, transforms))]
    for index, (_, matrix) in enumerate(lights):
        nodes.append({"matrix": matrix, "extensions": {"KHR_lights_punctual": {"light": index}}})
    nodes.append({"camera": 0, "matrix": looking(eye, [0, -0.3, 0])})
    scene = {"localViewer": True, "twoSided": False, "reflection": "blinn", "shading": "gouraud", **settings}
    lens = {"yfov": math.pi / 4, "aspectRatio": 1, "znear": 0.1, "zfar": 20}
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": EXTENSIONS,
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes))), "extensions": {"LUMBRE_scene": scene}}],
        "nodes": nodes,
        "extensions": {"KHR_lights_punctual": {"lights": [light for light, _ in lights]}},
        "cameras": [{"type": "perspective", "perspective": lens}],
        "materials": [
            {"doubleSided": sides, "extensions": {"LUMBRE_materials_phong": surface}}
            for surface, sides in zip(surfaces, double_sided)
        ],
    }
    write_glb(path, document, [(*shape, index) for index, shape in enumerate(shapes)])
