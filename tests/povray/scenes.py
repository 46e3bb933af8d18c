"""Three scenes of mirrors and glass, which `lumbre_file` and `povray_file` write. Metres, y up, linear RGB."""

import numpy as np


def matt(color, highlight=0.0, exponent=1.0, mirror=(0.0, 0.0, 0.0)):
    """k_a O_d = k_d O_d = `color`, k_s, n, and k_r."""
    return {"kind": "matt", "color": color, "highlight": highlight, "exponent": exponent, "mirror": mirror}


def glass(ior, clear=(1.0, 1.0, 1.0)):
    """Fresnel's equations divide the light. `clear` is what a metre of the medium leaves of it."""
    mirror, passing = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    return {"kind": "glass", "fresnel": True, "ior": ior, "clear": clear, "mirror": mirror, "passing": passing}


def coated(ior, mirror, clear=(1.0, 1.0, 1.0), passing=None):
    """k_r mirrors at every angle, and k_t passes: 1 - k_r, if it is not given."""
    passing = passing or tuple(1 - each for each in mirror)
    return {"kind": "glass", "fresnel": False, "ior": ior, "clear": clear, "mirror": mirror, "passing": passing}


def ball(middle, radius, material):
    return {"shape": "ball", "middle": middle, "radius": radius, "material": material}


def hollow_ball(middle, radius, material, bubble):
    """`bubble` is a ball of air in it, with the same k_r."""
    return {"shape": "hollow ball", "middle": middle, "radius": radius, "material": material, "bubble": bubble}


def block(middle, size, material):
    return {"shape": "block", "middle": middle, "size": size, "material": material}


def column(middle, radius, height, material):
    return {"shape": "column", "middle": middle, "radius": radius, "height": height, "material": material}


def cone(middle, radius, height, material):
    """Its base is half its height below the middle."""
    return {"shape": "cone", "middle": middle, "radius": radius, "height": height, "material": material}


def floor(half, material):
    """A square plane through the origin, so many metres to each side."""
    return {"shape": "floor", "middle": (0.0, 0.0, 0.0), "half": half, "material": material}


def lamp(position, light):
    return {"position": position, "light": light}


def sun(towards, light):
    """`towards` points at it."""
    return {"towards": towards, "light": light}


LIGHTS = [
    lamp((2.5, 5.0, 4.0), (0.5, 0.5, 0.45)),
    sun((-0.5, 1.0, 0.25), (0.25, 0.25, 0.3)),
]

# What both scenes of glass have in common, besides their things; and the floor and the wall behind these.
SETTING_OF_GLASS = {
    "camera": {"eye": (0.25, 1.75, 7.0), "target": (0.0, 1.0, 0.0), "fov": 36.0},
    "depth": 12,
    "highlights": False,
    "ambient": (0.1, 0.1, 0.1),
    "background": (0.1, 0.15, 0.25),
    "lights": LIGHTS,
}
BEHIND_GLASS = [
    floor(32.0, matt((0.5, 0.5, 0.55))),
    block((0.0, 1.625, -2.0), (5.0, 3.0, 0.25), matt((0.55, 0.5, 0.4))),
]

# `depth` is the number of mirrored and transmitted rays in succession. Without `highlights` no lamp makes any, since k_t L (t.v)^n has no
# counterpart in POV-Ray. No two surfaces touch.
SCENES = {
    "mirrors": {
        "camera": {"eye": (0.5, 2.0, 7.0), "target": (0.0, 0.9, 0.0), "fov": 36.0},
        "depth": 20,
        "highlights": True,
        "ambient": (0.1, 0.1, 0.12),
        "background": (0.1, 0.15, 0.25),
        "lights": LIGHTS,
        "things": [
            floor(32.0, matt((0.4, 0.4, 0.45), mirror=(0.3, 0.3, 0.3))),
            ball((-1.125, 1.0625, -0.25), 1.0, matt((0.05, 0.05, 0.05), 0.4, 60.0, mirror=(0.8, 0.75, 0.65))),
            ball((1.125, 1.0625, -0.25), 1.0, matt((0.05, 0.05, 0.05), 0.4, 20.0, mirror=(0.6, 0.7, 0.8))),
            ball((0.0, 0.5, 1.25), 0.375, matt((0.6, 0.15, 0.1), 0.3, 10.0)),
            column((-2.25, 1.0, 1.0), 0.25, 1.75, matt((0.1, 0.1, 0.1), 0.3, 40.0, mirror=(0.5, 0.5, 0.5))),
            cone((2.0, 0.5625, 1.5), 0.375, 1.0, matt((0.15, 0.45, 0.2), 0.2, 5.0)),
            block((0.0, 1.625, -2.0), (5.0, 3.0, 0.25), matt((0.1, 0.1, 0.1), mirror=(0.6, 0.6, 0.6))),
        ],
    },
    "glass": {
        **SETTING_OF_GLASS,
        "things": [
            *BEHIND_GLASS,
            ball((-1.25, 1.0625, 0.25), 0.9375, glass(1.5)),
            block((1.0, 0.875, 0.0), (1.25, 1.5, 1.25), glass(1.5, (0.5, 0.9, 0.7))),
            block((0.25, 1.0, 2.0), (1.5, 1.75, 0.0625), glass(1.33)),
            ball((-0.25, 0.5, -1.0), 0.375, matt((0.6, 0.1, 0.1))),
            ball((1.75, 0.5, -1.25), 0.375, matt((0.1, 0.2, 0.6))),
            cone((-1.75, 0.5625, -1.25), 0.375, 1.0, matt((0.1, 0.45, 0.2))),
        ],
    },
    "nested": {
        **SETTING_OF_GLASS,
        "things": [
            *BEHIND_GLASS,
            # Water in glass.
            ball((-1.25, 1.0625, 0.25), 0.9375, coated(1.5, (0.1, 0.1, 0.1))),
            ball((-1.125, 1.0, 0.25), 0.5, coated(1.33, (0.05, 0.05, 0.05), (0.3, 0.7, 0.9))),
            # A bubble of air in tinted glass.
            hollow_ball(
                (1.125, 1.0625, 0.25),
                0.9375,
                coated(1.5, (0.1, 0.15, 0.2), (0.9, 0.7, 0.5)),
                ball((1.0, 1.25, 0.375), 0.4375, coated(1.0, (0.1, 0.15, 0.2))),
            ),
            # A mirror and a matt ball in a column of glass.
            column((0.0, 0.75, 1.5), 0.375, 1.25, coated(1.33, (0.02, 0.02, 0.02))),
            ball((0.0, 1.0, 1.5), 0.1875, matt((0.0, 0.0, 0.0), mirror=(0.8, 0.8, 0.8))),
            ball((0.0, 0.5, 1.5), 0.1875, matt((0.6, 0.1, 0.1))),
        ],
    },
}


def axes(camera):
    """Right, up, backward."""
    eye, target = (np.array(camera[key], float) for key in ("eye", "target"))
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    return right, np.cross(back, right), back


def absorption(material):
    """In 1/m."""
    return -np.log(np.array(material["clear"], float))



def with_other(scene, thing, **values):
    """The scene with other values in the material of one thing."""
    things = list(scene["things"])
    things[thing] = things[thing] | {"material": things[thing]["material"] | values}
    return scene | {"things": things}


# Small mistakes, each of which a comparison must notice.
MISTAKES = {
    "exponent 61 instead of 60": ("mirrors", with_other(SCENES["mirrors"], 1, exponent=61.0)),
    "index of refraction off by 0.1 %": ("glass", with_other(SCENES["glass"], 2, ior=1.5015)),
    "absorption of blue light off by 0.4 %": ("glass", with_other(SCENES["glass"], 3, clear=(0.5, 0.9, 0.701))),
    "k_r of blue light off by 1 %": ("nested", with_other(SCENES["nested"], 2, mirror=(0.1, 0.1, 0.101))),
    "depth 11 instead of 12": ("nested", SCENES["nested"] | {"depth": 11}),
}
