"""Renders a scene of the suite with Blender's Cycles: python cycles_rows.py SCENE SIDE PATHS OUT.exr

It needs `pip install "bpy<5" mitsuba numpy` and Python 3.11; Mitsuba only writes the file. The script prints the
milliseconds of the image, with the transfer of the scene to Cycles and without the second image, of direct light, which
becomes the layer `direct`. Processor alone, no denoiser, no clamping, no limit on bounces below 1024, box filter. A
point light with a radius is a ball, not seen by the camera.
"""

import sys
import tempfile
import time
from pathlib import Path

import bpy
import mathutils
import numpy as np

from scenes import read, write_exr


def surface(material):
    made = bpy.data.materials.new(material["name"])
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    out, bsdf = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeBsdfDiffuse")
    bsdf.inputs["Color"].default_value = [*material["albedo"], 1]
    shader = bsdf.outputs[0]
    if material["emission"].any():
        # Light leaves the front of a lamp alone.
        strength = float(material["emission"].max())
        emission, front = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeNewGeometry")
        emission.inputs["Color"].default_value = [*(material["emission"] / strength), 1]
        emission.inputs["Strength"].default_value = strength
        mix = nodes.new("ShaderNodeMixShader")
        links.new(front.outputs["Backfacing"], mix.inputs["Fac"])
        links.new(emission.outputs[0], mix.inputs[1])
        links.new(bsdf.outputs[0], mix.inputs[2])
        shader = mix.outputs[0]
    links.new(shader, out.inputs["Surface"])
    return made


def build(name, side):
    entry, materials, lights = read(name)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene

    def place(name, data, at=(0, 0, 0)):
        made = bpy.data.objects.new(name, data)
        made.location = at
        scene.collection.objects.link(made)
        return made

    for material in materials:
        mesh = bpy.data.meshes.new(material["name"])
        mesh.from_pydata(material["vertices"].tolist(), [], material["triangles"].tolist())
        mesh.materials.append(surface(material))
        place(material["name"], mesh)
    for light in lights:
        color, strength = light["intensity"] / light["intensity"].max(), float(light["intensity"].max())
        made = bpy.data.lights.new("light", "SUN" if light["type"] == "directional" else "POINT")
        made.color = color
        if made.type == "SUN":
            made.energy, made.angle = strength, 0.0
        else:
            # The intensity of a point light is its power over 4 pi.
            made.energy, made.shadow_soft_size, made.use_soft_falloff = 4 * np.pi * strength, light["radius"], False
        lamp = place("light", made, light["at"])
        lamp.rotation_mode = "QUATERNION"
        lamp.rotation_quaternion = mathutils.Vector((0, 0, -1)).rotation_difference(mathutils.Vector(light["along"]))
        lamp.visible_camera = False
    eye, target, up = (np.array(entry[key]) for key in ["eye", "target", "up"])
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross(up, back) / np.linalg.norm(np.cross(up, back))
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle_y, camera.clip_start = "VERTICAL", np.radians(entry["fov_degrees"]), 1e-3
    scene.camera = place("camera", camera)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.stack([right, np.cross(back, right), back], 1), eye
    scene.camera.matrix_world = mathutils.Matrix(matrix.tolist())
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.resolution_percentage = 100
    settings = scene.cycles
    settings.use_adaptive_sampling = settings.use_denoising = settings.use_fast_gi = False
    settings.sample_clamp_direct = settings.sample_clamp_indirect = settings.blur_glossy = 0
    settings.light_sampling_threshold = 0
    settings.pixel_filter_type, settings.filter_width = "BOX", 1.0
    scene.world = bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    return scene


def main(name, side, paths, out):
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    scene = build(name, int(side))
    scene.cycles.samples = int(paths)

    def image(bounces):
        scene.cycles.max_bounces = scene.cycles.diffuse_bounces = bounces
        with tempfile.TemporaryDirectory() as folder:
            scene.render.filepath = str(Path(folder) / "image.exr")
            start = time.perf_counter()
            bpy.ops.render.render(write_still=True)
            milliseconds = 1e3 * (time.perf_counter() - start)
            return np.array(mitsuba.Bitmap(scene.render.filepath))[:, :, :3], milliseconds

    (whole, milliseconds), (direct, _) = image(1024), image(0)
    write_exr(out, whole, direct)
    print(f"{milliseconds:.0f}", file=sys.stderr)


main(*sys.argv[1:])
