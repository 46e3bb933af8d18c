"""Writes a scene for POV-Ray 3.7."""

import numpy as np

from scenes import absorption, axes

# POV-Ray's units in a metre. It ignores what a ray meets within a ten-thousandth of a unit of its start, and a shadow ray within a thousandth.
UNITS = 1000.0
# Metres to the sun, whose light is parallel: POV-Ray ends its shadow rays there.
FAR = 1000.0


def write(scene, path, size, medium="media"):
    """`medium` is how glass absorbs: `media` along every ray, `fade` where a ray leaves it."""
    parts = [
        "#version 3.7;",
        "global_settings {",
        f"  assumed_gamma 1.0 max_trace_level {scene['depth'] + 1} adc_bailout 0 ambient_light {rgb(scene['ambient'])}",
        "}",
        f"background {{ {rgb(scene['background'])} }}",
        camera(scene["camera"], size),
        *(light(own) for own in scene["lights"]),
        *(thing(own, medium) for own in scene["things"]),
    ]
    path.write_text("\n".join(parts) + "\n")


def camera(own, size):
    right, up, back = axes(own)
    height = 2 * np.tan(np.radians(own["fov"]) / 2)
    width = height * size[0] / size[1]
    view = f"location {place(own['eye'])} direction {vector(-back)}"
    return f"camera {{ perspective {view} right {vector(width * right)} up {vector(height * up)} }}"


def light(own):
    if "position" in own:
        return f"light_source {{ {place(own['position'])} {rgb(own['light'])} }}"
    towards = np.array(own["towards"], float)
    position = FAR * towards / np.linalg.norm(towards)
    return f"light_source {{ {place(position)} {rgb(own['light'])} parallel point_at 0 }}"


def thing(own, medium):
    material = own["material"]
    surface = matt(material) if material["kind"] == "matt" else glass(material, medium)
    return f"{shape(own)} {surface} }}"


def shape(own):
    """The object up to its material, its brace still open."""
    middle = np.array(own["middle"], float)
    match own["shape"]:
        case "ball":
            return f"sphere {{ {place(middle)}, {length(own['radius'])}"
        case "hollow ball":
            return f"difference {{ {shape(own | {'shape': 'ball'})} }} {shape(own['bubble'])} }}"
        case "block":
            half = 0.5 * np.array(own["size"], float)
            return f"box {{ {place(middle - half)}, {place(middle + half)}"
        case "column":
            base, top = ends(own)
            return f"cylinder {{ {base}, {top}, {length(own['radius'])}"
        case "cone":
            base, top = ends(own)
            return f"cone {{ {base}, {length(own['radius'])}, {top}, 0"
        case "floor":
            half = np.full(3, own["half"])
            return f"plane {{ y, {length(middle[1])} clipped_by {{ box {{ {place(middle - half)}, {place(middle + half)} }} }}"


def ends(own):
    half = np.array((0.0, own["height"] / 2, 0.0))
    return place(own["middle"] - half), place(own["middle"] + half)


def matt(own):
    finish = f"ambient 1 diffuse 1 phong {own['highlight']!r} phong_size {own['exponent']!r}"
    return f"pigment {{ {rgb(own['color'])} }} finish {{ {finish} reflection {{ {rgb(own['mirror'])} }} }}"


def glass(own, medium):
    passing = ", ".join(repr(each) for each in own["passing"])
    if own["fresnel"]:
        mirror = "reflection { rgb 0, rgb 1 fresnel on } conserve_energy"
    else:
        mirror = f"reflection {{ {rgb(own['mirror'])} }}"
    inside = f"ior {own['ior']!r}"
    coefficients = absorption(own)
    if coefficients.any():
        inside += {
            "media": f" media {{ absorption {rgb(coefficients / UNITS)} }}",
            "fade": f" fade_power 1001 fade_distance {length(1)} fade_color {rgb(1 - coefficients)}",
        }[medium]
    return (
        f"hollow pigment {{ rgbf <{passing}, 1> }} finish {{ ambient 0 diffuse 0 {mirror} }} interior {{ {inside} }}"
    )


def rgb(color):
    return f"rgb {vector(color)}"


def vector(values):
    return "<" + ", ".join(repr(float(value)) for value in values) + ">"


def place(metres):
    return vector(UNITS * np.array(metres, float))


def length(metres):
    return repr(UNITS * float(metres))
