"""Draws a .glb with OpenGL's fixed-function pipeline. Knows the LUMBRE extensions and no equation: all light is OpenGL's."""

import ctypes
import math
import os

os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
os.environ.setdefault("EGL_PLATFORM", "surfaceless")
os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")

import numpy as np
from OpenGL import EGL
from OpenGL.GL import *

from gltf import accessor, flattened, read_glb

# Under lights that are attenuated or have a cone, Mesa draws (n.l)^(n.l) where every shininess is 0 (ffvertex_prog.c leaves the
# registers of n.h and of the exponent holding n.l), where the specification has (n.h)^0 = 1. A tiny exponent avoids that branch.
TINY_SHININESS = 1e-6

DEFAULT_SURFACE = {"specular": [0, 0, 0], "emission": [0, 0, 0], "shininess": 1.0}
PARAMETERS = {"ambient": GL_AMBIENT, "diffuse": GL_DIFFUSE, "specular": GL_SPECULAR, "emission": GL_EMISSION}

TRIANGLE_NUMBERS = (
    "#version 150 compatibility\nvoid main() { gl_Position = ftransform(); }",
    "#version 150 compatibility\nvoid main() { gl_FragColor = vec4(float(gl_PrimitiveID + 1)); }",
)


class FixedFunction:
    """A context without a window, and a square target of 32-bit floats: no multisampling, no rounding to eight bits."""

    def __init__(self, size):
        self.size = size
        display = EGL.eglGetDisplay(EGL.EGL_DEFAULT_DISPLAY)
        if not EGL.eglInitialize(display, EGL.EGLint(), EGL.EGLint()):
            raise RuntimeError("no EGL display: install libegl-mesa0 and libgl1-mesa-dri")
        EGL.eglBindAPI(EGL.EGL_OPENGL_API)
        wanted = [EGL.EGL_SURFACE_TYPE, EGL.EGL_PBUFFER_BIT, EGL.EGL_RENDERABLE_TYPE, EGL.EGL_OPENGL_BIT, EGL.EGL_NONE]
        configs, found = (EGL.EGLConfig * 1)(), EGL.EGLint()
        EGL.eglChooseConfig(display, (ctypes.c_int * 5)(*wanted), configs, 1, found)
        context = EGL.eglCreateContext(display, configs[0], EGL.EGL_NO_CONTEXT, None)
        EGL.eglMakeCurrent(display, EGL.EGL_NO_SURFACE, EGL.EGL_NO_SURFACE, context)
        self.name = f"{glGetString(GL_VERSION).decode()}, {glGetString(GL_RENDERER).decode()}"
        glBindFramebuffer(GL_FRAMEBUFFER, glGenFramebuffers(1))
        for attachment, texels in ((GL_COLOR_ATTACHMENT0, GL_RGBA32F), (GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F)):
            buffer = glGenRenderbuffers(1)
            glBindRenderbuffer(GL_RENDERBUFFER, buffer)
            glRenderbufferStorage(GL_RENDERBUFFER, texels, size, size)
            glFramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer)
        if glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE:
            raise RuntimeError("no target of 32-bit floats")
        glViewport(0, 0, size, size)
        glEnable(GL_DEPTH_TEST)
        glEnable(GL_NORMALIZE)
        self.triangle_numbers = program(TRIANGLE_NUMBERS)

    def draw(self, path):
        """Colours (size x size x 3, linear, top row first) and the surface of each pixel: 0 for the background, else one number
        for each side of each mesh, for flat shading of each triangle."""
        document, data = read_glb(path)
        nodes = flattened(document)
        scene = document["scenes"][document.get("scene", 0)].get("extensions", {}).get("LUMBRE_scene", {})
        camera, place = next((node, place) for node, place in nodes if "camera" in node)
        view = np.linalg.inv(place)
        glMatrixMode(GL_PROJECTION)
        load(perspective(document["cameras"][camera["camera"]]["perspective"]))
        surfaces = self.surfaces(document, data, nodes, view, scene.get("shading") == "flat")
        self.clear(scene.get("background", [0, 0, 0]))
        attenuated = light_state(document, nodes, view, scene)
        fog_state(scene.get("fog"))
        for material, draw in meshes(document, data, nodes, view):
            material_state(material, attenuated)
            draw()
        glDisable(GL_FOG)
        return np.clip(self.read()[..., :3], 0.0, 1.0), surfaces

    def surfaces(self, document, data, nodes, view, by_triangle):
        """The surface of each pixel, drawn by the same pipeline as the picture."""
        self.clear([0, 0, 0])
        glEnable(GL_LIGHTING)
        glShadeModel(GL_SMOOTH)
        for light in range(8):
            glDisable(GL_LIGHT0 + light)
        glLightModelfv(GL_LIGHT_MODEL_AMBIENT, [0, 0, 0, 1])
        glLightModeli(GL_LIGHT_MODEL_TWO_SIDE, 1)
        for number, (_, draw) in enumerate(meshes(document, data, nodes, view)):
            for face, side in ((GL_FRONT, 0), (GL_BACK, 1)):
                for parameter in (GL_AMBIENT, GL_DIFFUSE, GL_SPECULAR):
                    glMaterialfv(face, parameter, [0, 0, 0, 1])
                glMaterialfv(face, GL_EMISSION, [(2 * number + side + 1) / 16, 0, 0, 1])
            draw()
        surfaces = np.round(16 * self.read()[..., 0])
        if by_triangle:
            self.clear([0, 0, 0])
            glUseProgram(self.triangle_numbers)
            for _, draw in meshes(document, data, nodes, view):
                draw()
            glUseProgram(0)
            surfaces += 16 * self.read()[..., 0]
        return surfaces.astype(np.float32)

    def clear(self, color):
        glClearColor(*color, 1)
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT)

    def read(self):
        texels = glReadPixels(0, 0, self.size, self.size, GL_RGBA, GL_FLOAT)
        return np.frombuffer(texels, np.float32).reshape(self.size, self.size, 4)[::-1].copy()


def program(sources):
    linked = glCreateProgram()
    for kind, source in zip((GL_VERTEX_SHADER, GL_FRAGMENT_SHADER), sources):
        shader = glCreateShader(kind)
        glShaderSource(shader, source)
        glCompileShader(shader)
        glAttachShader(linked, shader)
    glLinkProgram(linked)
    if not glGetProgramiv(linked, GL_LINK_STATUS):
        raise RuntimeError(glGetProgramInfoLog(linked))
    return linked


def load(matrix):
    glLoadMatrixf(np.ascontiguousarray(matrix.T, np.float32))


def perspective(lens):
    focal, near, far = 1 / math.tan(lens["yfov"] / 2), lens["znear"], lens["zfar"]
    depth = [(far + near) / (near - far), 2 * far * near / (near - far)]
    return np.array([[focal, 0, 0, 0], [0, focal, 0, 0], [0, 0, *depth], [0, 0, -1, 0]])


def light_state(document, nodes, view, scene):
    """Lights and light model; whether any light has a distance or a cone."""
    glEnable(GL_LIGHTING)
    glShadeModel(GL_FLAT if scene.get("shading") == "flat" else GL_SMOOTH)
    glLightModelfv(GL_LIGHT_MODEL_AMBIENT, [*scene.get("ambient", [0, 0, 0]), 1])
    glLightModeli(GL_LIGHT_MODEL_TWO_SIDE, scene["twoSided"])
    glLightModeli(GL_LIGHT_MODEL_LOCAL_VIEWER, scene.get("localViewer", True))
    glMatrixMode(GL_MODELVIEW)
    load(view)
    light, attenuated = GL_LIGHT0, False
    for node, place in nodes:
        reference = node.get("extensions", {}).get("KHR_lights_punctual")
        if reference is None:
            continue
        source = document["extensions"]["KHR_lights_punctual"]["lights"][reference["light"]]
        phong = source["extensions"]["LUMBRE_lights_phong"]
        if not phong.get("enabled", True):
            continue
        strength = [channel * source.get("intensity", 1) for channel in source.get("color", [1, 1, 1])]
        glEnable(light)
        glLightfv(light, GL_AMBIENT, [*phong.get("ambient", [0, 0, 0]), 1])
        glLightfv(light, GL_DIFFUSE, [*phong.get("diffuse", strength), 1])
        glLightfv(light, GL_SPECULAR, [*phong.get("specular", strength), 1])
        backward = place[:3, 2] / np.linalg.norm(place[:3, 2])
        directional = source["type"] == "directional"
        glLightfv(light, GL_POSITION, [*backward, 0] if directional else [*place[:3, 3], 1])
        coefficients = phong.get("attenuation", [1, 0, 0])
        for parameter, value in zip((GL_CONSTANT_ATTENUATION, GL_LINEAR_ATTENUATION, GL_QUADRATIC_ATTENUATION), coefficients):
            glLightf(light, parameter, value)
        cone = phong.get("spot", {"cutoff": math.pi, "exponent": 0})
        glLightfv(light, GL_SPOT_DIRECTION, list(-backward))
        # Through f32 and back, 90 and 180 degrees stay what they are.
        glLightf(light, GL_SPOT_CUTOFF, round(math.degrees(cone["cutoff"]), 5))
        glLightf(light, GL_SPOT_EXPONENT, cone.get("exponent", 0))
        attenuated |= "spot" in phong or not directional
        light += 1
    return attenuated


def fog_state(fog):
    if fog is None:
        return
    glEnable(GL_FOG)
    glFogi(GL_FOG_MODE, {"linear": GL_LINEAR, "exp": GL_EXP, "exp2": GL_EXP2}[fog.get("mode", "exp")])
    glFogfv(GL_FOG_COLOR, [*fog.get("color", [0, 0, 0]), 1])
    glFogf(GL_FOG_START, fog.get("start", 0))
    glFogf(GL_FOG_END, fog.get("end", 1))
    glFogf(GL_FOG_DENSITY, fog.get("density", 1))


def material_state(material, attenuated):
    phong = material["extensions"]["LUMBRE_materials_phong"]
    base = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", [1, 1, 1, 1])[:3]
    front = {"ambient": base, "diffuse": base, **DEFAULT_SURFACE, **phong}
    for face, surface in ((GL_FRONT, front), (GL_BACK, {**front, **phong.get("back", {})})):
        for key, parameter in PARAMETERS.items():
            glMaterialfv(face, parameter, [*surface[key], 1])
        glMaterialf(face, GL_SHININESS, max(surface["shininess"], TINY_SHININESS if attenuated else 0))


def meshes(document, data, nodes, view):
    """The material of each primitive and how it is drawn, with its transform, winding and arrays set."""
    for node, place in nodes:
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            glMatrixMode(GL_MODELVIEW)
            load(view @ place)
            # glTF: a mirroring transform turns the winding around.
            glFrontFace(GL_CW if np.linalg.det(place[:3, :3]) < 0 else GL_CCW)
            material = document["materials"][primitive["material"]]
            (glDisable if material.get("doubleSided", False) else glEnable)(GL_CULL_FACE)
            positions, normals = (accessor(document, data, primitive["attributes"][name]) for name in ("POSITION", "NORMAL"))
            indices = accessor(document, data, primitive["indices"]).astype(np.uint32).ravel()
            glEnableClientState(GL_VERTEX_ARRAY)
            glEnableClientState(GL_NORMAL_ARRAY)
            glVertexPointer(3, GL_FLOAT, 0, positions)
            glNormalPointer(GL_FLOAT, 0, normals)
            yield material, lambda: glDrawElements(GL_TRIANGLES, len(indices), GL_UNSIGNED_INT, indices)
