#!/usr/bin/env python3
"""Prints hashes of the pixels of some two dozen images: all presets, three scenes, two sizes, further layers,
sequences.

A change without effect on images gives the same hashes on the same device:
    scripts/image-hashes.py PROGRAM [SCENE...] > before.txt
    (build the changed program, then repeat with > after.txt)
    diff before.txt after.txt
SCENEs are further scenes to render, such as a textured model. The hashes cover pixels only, not the headers of files.
"""

import hashlib
import pathlib
import struct
import subprocess
import sys
import tempfile

PRESETS = ["fast", "balanced", "accurate", "cones", "corrected", "printed", "lpv", "lpv-printed", "photons", "photons-printed", "probes"]
LAYERS = "direct,indirect,ao,normal,depth,albedo,diffuse"


def cases(extra):
    for scene in ["cornell-area", "cornell-point", "gallery"]:
        for preset in PRESETS:
            yield f"{scene} {preset}", f"assets/{scene}.glb", ["--preset", preset, "--size", "96x64", "--set", "voxels=32"]
    for preset in ["fast", "balanced", "printed"]:
        yield f"gallery {preset} layers", "assets/gallery.glb", \
            ["--preset", preset, "--size", "200x120", "--set", "voxels=64", "--aov", LAYERS]
    for preset in ["fast", "cones"]:
        yield f"cornell-area {preset} all bounces", "assets/cornell-area.glb", \
            ["--preset", preset, "--size", "64x64", "--set", "voxels=32", "--set", "bounces=all", "--sky", "0.1,0.2,0.3"]
    yield "gallery direct", "assets/gallery.glb", ["--method", "none", "--size", "96x64", "--set", "voxels=32", "--preset", "fast"]
    for preset in ["fast", "cones"]:
        yield f"gallery {preset} sequence", "assets/gallery.glb", \
            ["--preset", preset, "--size", "64x48", "--set", "voxels=32", "--frames", "3", "--fps", "2"]
    for scene in extra:
        name = pathlib.Path(scene).stem
        for preset in PRESETS:
            yield f"{name} {preset}", scene, ["--preset", preset, "--size", "96x64", "--set", "voxels=32"]
        yield f"{name} fast layers", scene, ["--preset", "fast", "--size", "200x120", "--set", "voxels=64", "--aov", LAYERS]
        yield f"{name} fast sequence", scene, ["--preset", "fast", "--size", "64x48", "--set", "voxels=32", "--frames", "3", "--fps", "2"]


def pixels(exr):
    """The bytes of an OpenEXR file after its header and its table of offsets, which depends on the header's size."""
    data = exr.read_bytes()
    at = 8  # magic number, version
    while data[at] != 0:
        name_end = data.index(0, at)
        type_end = data.index(0, name_end + 1)
        (size,) = struct.unpack_from("<i", data, type_end + 1)
        at = type_end + 5 + size
    (first,) = struct.unpack_from("<Q", data, at + 1)
    return data[first:]


def main():
    program, extra = sys.argv[1], sys.argv[2:]
    with tempfile.TemporaryDirectory() as folder:
        for name, scene, flags in cases(extra):
            pattern = pathlib.Path(folder) / ("out_%02d.exr" if "--frames" in flags else "out.exr")
            for old in pathlib.Path(folder).iterdir():
                old.unlink()
            done = subprocess.run([program, "render", scene, "-o", str(pattern), "--noise=off", *flags], capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(f"{name}: {done.stderr}")
            digest = hashlib.sha256()
            for image in sorted(pathlib.Path(folder).iterdir()):
                digest.update(pixels(image))
            print(f"{digest.hexdigest()[:24]}  {name}", flush=True)


main()
