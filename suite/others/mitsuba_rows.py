"""Renders a scene of the suite with Mitsuba 3: python mitsuba_rows.py SCENE SIDE PATHS OUT.exr

It needs `pip install mitsuba numpy`. The script prints the milliseconds of the image, without loading and without the
second image, of direct light, which becomes the layer `direct`. Integrator `path`, paths without a limit, box filter. A
point light with a radius is a ball of the radiance intensity / (pi radius^2), as in the references; it is hidden where
the camera would see it.
"""

import sys
import time

import mitsuba
import numpy as np

mitsuba.set_variant("scalar_rgb")

from scenes import ball_pixels, read, write_exr  # noqa: E402


def rgb(color):
    return {"type": "rgb", "value": [float(value) for value in color]}


def mesh(material):
    made = mitsuba.Mesh(
        material["name"], len(material["vertices"]), len(material["triangles"]), props=properties(material)
    )
    parameters = mitsuba.traverse(made)
    parameters["vertex_positions"] = material["vertices"].ravel().astype(np.float32)
    parameters["faces"] = material["triangles"].ravel().astype(np.uint32)
    parameters.update()
    return made


def properties(material):
    made = mitsuba.Properties()
    diffuse = {"type": "diffuse", "reflectance": rgb(material["albedo"])}
    made["bsdf"] = mitsuba.load_dict({"type": "twosided", "bsdf": diffuse})
    if material["emission"].any():
        made["emitter"] = mitsuba.load_dict({"type": "area", "radiance": rgb(material["emission"])})
    return made


def load(name, side):
    entry, materials, lights = read(name)
    look = mitsuba.ScalarTransform4f().look_at(entry["eye"], entry["target"], entry["up"])
    film = {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}, "component_format": "float32"}
    sensor = {"type": "perspective", "fov": entry["fov_degrees"], "fov_axis": "y", "to_world": look, "film": film}
    sensor |= {"near_clip": 1e-3, "sampler": {"type": "independent"}}
    scene = {"type": "scene", "sensor": sensor} | {f"mesh{i}": mesh(m) for i, m in enumerate(materials)}
    for i, light in enumerate(lights):
        if light["type"] == "directional":
            scene[f"light{i}"] = {
                "type": "directional",
                "direction": light["along"].tolist(),
                "irradiance": rgb(light["intensity"]),
            }
            continue
        assert light["type"] == "point" and light["radius"] > 0, light
        radiance = rgb(light["intensity"] / (np.pi * light["radius"] ** 2))
        ball = {"type": "sphere", "center": light["at"].tolist(), "radius": light["radius"]}
        black = {"type": "diffuse", "reflectance": rgb([0, 0, 0])}
        scene[f"light{i}"] = ball | {"bsdf": black, "emitter": {"type": "area", "radiance": radiance}}
    return mitsuba.load_dict(scene), entry, [light for light in lights if light["type"] == "point"]


def main(name, side, paths, out):
    side, paths = int(side), int(paths)
    scene, entry, balls = load(name, side)

    def image(depth, hidden):
        integrator = {"type": "path", "max_depth": depth, "rr_depth": 8, "hide_emitters": hidden}
        integrator, start = mitsuba.load_dict(integrator), time.perf_counter()
        pixels = np.array(mitsuba.render(scene, integrator=integrator, spp=paths, seed=1))[:, :, :3]
        return pixels, 1e3 * (time.perf_counter() - start)

    (whole, milliseconds), (direct, _) = image(-1, False), image(2, False)
    for light in balls:
        seen = ball_pixels(entry, light, side)[:, :, None]
        whole, direct = np.where(seen, image(-1, True)[0], whole), np.where(seen, image(2, True)[0], direct)
    write_exr(out, whole, direct)
    print(f"{milliseconds:.0f}")


main(*sys.argv[1:])
