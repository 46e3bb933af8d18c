"""How a scene of tests/mitsuba is written for Cycles, and its balls as triangles, which both programs get."""

import bpy
import numpy as np

# Twenty triangles of an icosahedron, each halved along its edges so many times.
HALVINGS = 5


def with_meshes(objects):
    """The scene with triangles for its balls: Cycles has no exact ones whose inside rays can be in."""
    return [ball_mesh(thing) if thing["shape"] == "ball" else thing for thing in objects]


def ball_mesh(thing):
    golden = (1 + np.sqrt(5)) / 2
    corners = [(side * 1.0, other * golden, 0.0) for side in (-1, 1) for other in (-1, 1)]
    points = np.array([np.roll(corner, turn) for turn in range(3) for corner in corners])
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = np.isclose(apart, 2.0)
    numbers = range(len(points))
    triangles = [(a, b, c) for a in numbers for b in numbers for c in numbers if a < b < c and near[a, b] and near[b, c] and near[a, c]]
    unit = [point / np.linalg.norm(point) for point in points]
    triangles = [outwards(unit, triangle) for triangle in triangles]
    for _ in range(HALVINGS):
        triangles = halved(unit, triangles)
    normals = np.array(unit)
    positions = normals * thing["radius"] + np.array(thing["middle"], float)
    return {
        "shape": "mesh",
        "positions": positions,
        "normals": normals,
        "triangles": np.array(triangles),
        "material": thing["material"],
    }


def outwards(unit, triangle):
    a, b, c = triangle
    return (a, b, c) if np.dot(np.cross(unit[b] - unit[a], unit[c] - unit[a]), unit[a]) > 0 else (a, c, b)


def halved(unit, triangles):
    """Adds the middles of the edges to the points, and returns four triangles for each."""
    middles = {}

    def middle(a, b):
        key = (min(a, b), max(a, b))
        if key not in middles:
            middles[key] = len(unit)
            unit.append((unit[a] + unit[b]) / np.linalg.norm(unit[a] + unit[b]))
        return middles[key]

    finer = []
    for a, b, c in triangles:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return finer


def load(objects, camera, matrix, size, faces_of_box):
    """Makes the scene Cycles' scene, with nothing that would bias its picture or end it early."""
    import addon_utils

    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("cycles", default_set=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    render, cycles = scene.render, scene.cycles
    render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
    render.threads_mode, render.threads = "FIXED", 2
    render.use_persistent_data = True
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode, render.image_settings.color_depth = "RGB", "32"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_guiding = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.light_sampling_threshold = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", 1024)
    for number, thing in enumerate(objects):
        add(scene, number, thing, faces_of_box)
    view = bpy.data.cameras.new("view")
    view.sensor_fit, view.clip_start = "VERTICAL", 0.01
    view.angle = np.radians(camera["fov"])
    scene.camera = bpy.data.objects.new("view", view)
    scene.camera.matrix_world = matrix.T.tolist()
    scene.collection.objects.link(scene.camera)
    return scene


def add(scene, number, thing, faces_of_box):
    if thing["shape"] == "mesh":
        positions, faces = thing["positions"], thing["triangles"]
    else:
        quads = [(thing["corner"], thing["u"], thing["v"])] if thing["shape"] == "quad" else faces_of_box(thing)
        positions, faces = [], []
        for corner, u, v in quads:
            corner, u, v = (np.array(value, float) for value in (corner, u, v))
            first = len(positions)
            positions += [corner, corner + u, corner + u + v, corner + v]
            faces.append((first, first + 1, first + 2, first + 3))
    mesh = bpy.data.meshes.new(f"thing {number}")
    mesh.from_pydata([tuple(position) for position in positions], [], [tuple(face) for face in faces])
    if thing["shape"] == "mesh":
        mesh.shade_smooth()
        mesh.normals_split_custom_set_from_vertices([tuple(normal) for normal in thing["normals"]])
    mesh.materials.append(material(thing["material"]))
    scene.collection.objects.link(bpy.data.objects.new(f"thing {number}", mesh))


def material(described):
    made = bpy.data.materials.new(described["kind"])
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    node = tree.nodes.new
    link = tree.links.new

    def shader(kind, color=(1.0, 1.0, 1.0), **inputs):
        found = node(f"ShaderNode{kind}")
        found.inputs["Color"].default_value = (*color, 1.0)
        for name, value in inputs.items():
            found.inputs[name].default_value = value
        return found

    def front():
        """1 at fronts and 0 at backs, which are black where Cycles' own materials have two sides."""
        found = node("ShaderNodeMath")
        found.operation = "SUBTRACT"
        found.inputs[0].default_value = 1.0
        link(node("ShaderNodeNewGeometry").outputs["Backfacing"], found.inputs[1])
        return found.outputs[0]

    match described["kind"]:
        case "matt":
            surface = shader("BsdfDiffuse", described["color"], Roughness=0.0)
        case "mirror":
            surface = shader("BsdfAnisotropic", Roughness=0.0)
            weight = node("ShaderNodeVectorMath")
            weight.operation = "SCALE"
            weight.inputs[0].default_value = described["weight"]
            link(front(), weight.inputs["Scale"])
            link(weight.outputs[0], surface.inputs["Color"])
        case "glass":
            surface = shader("BsdfGlass", Roughness=0.0, IOR=described["ior"] / described["around"])
        case "light":
            surface = shader("Emission", described["radiance"])
            link(front(), surface.inputs["Strength"])
            made.cycles.emission_sampling = "FRONT"
        case "sheet":
            surface = sheet(node, link, shader, described["ior"])
    link(surface.outputs[0], node("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def sheet(node, link, shader, ior):
    """Two faces without a distance: of R at each, 2 R / (1 + R) is mirrored and the rest goes straight on."""
    fresnel, geometry = node("ShaderNodeFresnel"), node("ShaderNodeNewGeometry")

    def computed(operation, *operands):
        found = node("ShaderNodeMath")
        found.operation = operation
        for place, operand in zip(found.inputs, operands):
            if isinstance(operand, float):
                place.default_value = operand
            else:
                link(operand, place)
        return found.outputs[0]

    # At a back the node inverts the index, which here is the same on both sides.
    index = computed("MULTIPLY_ADD", geometry.outputs["Backfacing"], 1.0 / ior - ior, ior)
    link(index, fresnel.inputs["IOR"])
    once = fresnel.outputs[0]
    mirrored = computed("DIVIDE", computed("MULTIPLY", once, 2.0), computed("ADD", once, 1.0))
    surface = node("ShaderNodeMixShader")
    link(mirrored, surface.inputs[0])
    link(shader("BsdfTransparent").outputs[0], surface.inputs[1])
    link(shader("BsdfAnisotropic", Roughness=0.0).outputs[0], surface.inputs[2])
    return surface
