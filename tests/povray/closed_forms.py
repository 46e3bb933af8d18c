"""Where POV-Ray's model is another one: scenes of a single ray whose radiance has a closed form."""

import numpy as np

from scenes import block, coated, glass, matt

SKY = np.array((0.5, 0.6, 0.7))
WALL = np.array((0.7, 0.6, 0.5))


def scene(things, eye=(0.0, 0.0, 6.0), target=(0.0, 0.0, 0.0), ambient=(0.0, 0.0, 0.0), background=(0.0, 0.0, 0.0)):
    return {
        "camera": {"eye": eye, "target": target, "fov": 10.0},
        "depth": 16,
        "highlights": False,
        "ambient": ambient,
        "background": background,
        "lights": [],
        "things": things,
    }


def head_on(one, other):
    """Fresnel's reflectance at right angles between two indices of refraction."""
    return ((one - other) / (one + other)) ** 2


def through(faces):
    """The light that passes parallel faces of these reflectances, with all reflections between them."""
    reflected, passed = 0.0, 1.0
    for face in faces:
        between = 1 - reflected * face
        reflected, passed = face + (1 - face) ** 2 * reflected / between, passed * (1 - face) / between
    return passed


def absorbing_plate():
    """A metre of tinted glass in front of a sky: F + (1 - F)² a / (1 - F a), where a is what a metre leaves."""
    clear = np.array((0.2, 0.4, 0.8))
    face = head_on(1.0, 1.5)
    radiance = SKY * (face + (1 - face) ** 2 * clear / (1 - face * clear))
    plate = scene([block((0, 0, 0), (4, 4, 1), glass(1.5, tuple(clear)))], background=tuple(SKY))
    return plate, radiance


def nested_plates():
    """A plate of index 2 in one of 1.5, in front of a wall that shines."""
    outside, inside = head_on(1.0, 1.5), head_on(1.5, 2.0)
    things = [
        block((0, 0, 0), (4, 4, 2), glass(1.5)),
        block((0, 0, 0), (2, 2, 1), glass(2.0)),
        block((0, 0, -4), (32, 32, 1), matt(tuple(WALL))),
    ]
    return scene(things, ambient=(1.0, 1.0, 1.0)), WALL * through([outside, inside, inside, outside])


def total_reflection():
    """In at the front, totally reflected by the top, out at the back: k_t³, since total reflection sends back k_t."""
    passing = (0.8, 0.7, 0.6)
    glass_block = block((0, 0, 0), (4, 1, 2), coated(1.5, (0.0, 0.0, 0.0), passing=passing))
    # The sine of the angle of incidence is 0.6, and 0.4 inside.
    seen = scene([glass_block], eye=(0.0, -3.0, 5.0), target=(0.0, 0.0, 1.0), background=tuple(SKY))
    return seen, SKY * np.array(passing) ** 3


def form(name, described, medium="media"):
    seen, radiance = described
    return {"name": name, "scene": seen, "radiance": radiance, "medium": medium}


FORMS = [
    form("absorbing plate, as media", absorbing_plate()),
    form("absorbing plate, as fade_power", absorbing_plate(), "fade"),
    form("nested plates", nested_plates()),
    form("total reflection", total_reflection()),
]
