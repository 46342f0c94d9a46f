"""The diffuse scenes of the suite as arrays, for the scripts beside this file.

A scene of the suite is read from its .glb: triangles in the world with the vertices of each material, the materials'
albedo and emission, and the lights. Six of the eight scenes are made of Lambertian surfaces, area lamps, point lights
and a sun alone; `read` refuses the other two.
"""

import json
import struct
import tomllib
from pathlib import Path

import numpy as np

SUITE = Path(__file__).resolve().parent.parent


def entries():
    """The scenes of suite.toml by name."""
    return {scene["name"]: scene for scene in tomllib.loads((SUITE / "suite.toml").read_text())["scene"]}


def rotation(quaternion):
    """The matrix of a quaternion x, y, z, w."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def read(name):
    """(entry, materials, lights): a material is a dict of vertices, triangles, albedo and emission; a light is a
    dict."""
    entry = entries()[name]
    data = (SUITE / entry["file"]).read_bytes()
    length = struct.unpack("<I", data[12:16])[0]
    gltf, binary = json.loads(data[20 : 20 + length]), data[28 + length :]
    if "animations" in gltf:
        raise SystemExit(f"{name} moves and has metals and glass, which this reader leaves out")

    def array(index):
        accessor = gltf["accessors"][index]
        view = gltf["bufferViews"][accessor["bufferView"]]
        kind = {5126: "<f4", 5123: "<u2", 5125: "<u4", 5121: "u1"}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        return np.frombuffer(binary, kind, accessor["count"] * width, start).reshape(-1, width)

    materials = []
    for material in gltf["materials"]:
        plain, extensions = material["pbrMetallicRoughness"], material.get("extensions", {})
        assert extensions["KHR_materials_specular"]["specularFactor"] == 0 and plain["metallicFactor"] == 0, material
        strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
        emission = strength * np.array(material.get("emissiveFactor", [0, 0, 0]), float)
        albedo = np.array(plain["baseColorFactor"][:3], float)
        materials.append({"name": material["name"], "albedo": albedo, "emission": emission, "meshes": []})
    lights = []
    for node in gltf["nodes"]:
        assert "children" not in node and "scale" not in node and "matrix" not in node, node
        turn, move = rotation(node.get("rotation", [0, 0, 0, 1])), np.array(node.get("translation", [0, 0, 0]), float)
        for part in gltf["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            vertices = array(part["attributes"]["POSITION"]) @ turn.T + move
            materials[part["material"]]["meshes"].append((vertices, array(part["indices"]).reshape(-1, 3)))
        light = node.get("extensions", {}).get("KHR_lights_punctual")
        if light:
            found = gltf["extensions"]["KHR_lights_punctual"]["lights"][light["light"]]
            color = found["intensity"] * np.array(found["color"], float)
            radius = found.get("extras", {}).get("radius", 0.0)
            lights.append(
                {"type": found["type"], "at": move, "along": -turn[:, 2], "intensity": color, "radius": radius}
            )
    for material in materials:
        start, vertices, triangles = 0, [np.zeros((0, 3))], [np.zeros((0, 3), int)]
        for points, indices in material.pop("meshes"):
            vertices.append(points)
            triangles.append(indices.astype(int) + start)
            start += len(points)
        material["vertices"], material["triangles"] = np.concatenate(vertices), np.concatenate(triangles)
    return entry, [material for material in materials if len(material["triangles"])], lights


def ball_pixels(entry, light, side):
    """The pixels in which a ball of light of the scene would be seen, with a pixel around them: the suite's lights are
    not seen."""
    eye, target, up = (np.array(entry[key]) for key in ["eye", "target", "up"])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, up) / np.linalg.norm(np.cross(forward, up))
    to, half = light["at"] - eye, np.tan(np.radians(entry["fov_degrees"]) / 2)
    ahead = to @ forward
    x, y = (to @ right / ahead / half + 1) * side / 2, (1 - to @ np.cross(right, forward) / ahead / half) * side / 2
    radius = 1.1 * light["radius"] / ahead / half * side / 2 + 2
    rows, columns = np.mgrid[0:side, 0:side] + 0.5
    return (columns - x) ** 2 + (rows - y) ** 2 < radius**2


def write_exr(path, image, direct):
    """Writes linear radiance, with emission and direct light as the layer `direct`."""
    import mitsuba

    if mitsuba.variant() is None:
        mitsuba.set_variant("scalar_rgb")
    both = np.ascontiguousarray(np.concatenate([image, direct], axis=2), np.float32)
    names = ["R", "G", "B", "direct.R", "direct.G", "direct.B"]
    bitmap = mitsuba.Bitmap(both, mitsuba.Bitmap.PixelFormat.MultiChannel, names)
    bitmap.write(str(path))
