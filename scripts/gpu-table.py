#!/usr/bin/env python3
"""Measures every pass of the presets on a device, and the error of their images: see scripts/gpu-table.sh, which calls
this.

Times are medians of five frames from scratch after two to warm up, in milliseconds of the device. Errors are `rel` and
energy of the whole image at 240 by 135 pixels against the path tracer's image with as many bounces (docs/accuracy.md).
"""

import argparse
import array
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/twobounce"
PRESETS = ["fast", "balanced", "accurate", "cones", "corrected", "printed", "lpv", "photons"]
SIZES = ["1920x1080", "2560x1440", "3840x2160"]
ERROR_SIZE = "240x135"
# The largest share of the total time for timing, so that errors are measured too.
SHARE_OF_TIMES = 0.65


def write_terrain(path, edge):
    """A glTF file of hills: 2 * edge * edge triangles on 10 by 10 metres, under a sky."""
    side = edge + 1
    positions, normals = array.array("f"), array.array("f")
    for z in range(side):
        for x in range(side):
            u, v = 10.0 * x / edge, 10.0 * z / edge
            positions.extend((u, 0.4 * math.sin(1.7 * u) * math.cos(1.3 * v) + 0.05 * math.sin(23.0 * u + 17.0 * v), v))
            normals.extend((0.0, 1.0, 0.0))
    indices = array.array("I")
    for z in range(edge):
        for x in range(edge):
            a = z * side + x
            indices.extend((a, a + side, a + 1, a + 1, a + side, a + side + 1))
    blob = indices.tobytes() + positions.tobytes() + normals.tobytes()
    count, starts = side * side, [0, len(indices) * 4, len(indices) * 4 + side * side * 12]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.5, 0.4, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1, "NORMAL": 2}, "indices": 0, "material": 0}]}],
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": [{"buffer": 0, "byteOffset": start, "byteLength": end - start}
                        for start, end in zip(starts, starts[1:] + [len(blob)])],
        "accessors": [
            {"bufferView": 0, "componentType": 5125, "count": len(indices), "type": "SCALAR"},
            {"bufferView": 1, "componentType": 5126, "count": count, "type": "VEC3",
             "min": [min(positions[k::3]) for k in range(3)], "max": [max(positions[k::3]) for k in range(3)]},
            {"bufferView": 2, "componentType": 5126, "count": count, "type": "VEC3"},
        ],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    blob += b"\0" * (-len(blob) % 4)
    head = struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(blob))
    path.write_bytes(head + struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(blob), 0x004E4942) + blob)


class Run:
    """Runs the program until the time is used up."""

    def __init__(self, seconds, device):
        self.end = time.monotonic() + seconds
        self.device = ["--device", device] if device else []

    def __call__(self, *arguments, until=0.0):
        left = self.end - until - time.monotonic()
        if left < 1.0:
            return False
        command = [str(PROGRAM), *map(str, arguments)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=left)
        except subprocess.TimeoutExpired:
            return False
        if done.returncode != 0:
            print(f"gpu-table: {' '.join(command)}\n{done.stderr.strip()}", file=sys.stderr)
        return done.returncode == 0


def timed(run, scene, size, preset, voxels, folder, keep):
    """Times of frames, or None."""
    out, numbers = folder / "image.exr", folder / "render.json"
    flags = ["--preset", preset, "--size", size, "--set", f"voxels={voxels}", "--repeat", "5", "--json", numbers, "-q", *run.device]
    return json.loads(numbers.read_text()) if run("render", scene, "-o", out, *flags, until=keep) else None


def errors(run, scene, preset, voxels, folder, reference):
    """Relative error and energy of a small image, or None."""
    out, numbers = folder / "small.exr", folder / "compare.json"
    flags = ["--preset", preset, "--size", ERROR_SIZE, "--set", f"voxels={voxels}", "--noise=off", "-q", *run.device]
    if not run("render", scene, "-o", out, *flags) or not run("compare", out, reference, "--json", numbers):
        return None
    total = json.loads(numbers.read_text())["total"]
    return {"rel": total["rel"], "energy": total["energy"]}


def milliseconds(value):
    return "–" if value is None else f"{value:.3g}" if value < 100 else f"{value:.0f}"


def table(rows):
    """A table in Markdown, from rows of cells; the first row is the head."""
    yield "| " + " | ".join(rows[0]) + " |"
    yield "|---|---|" + "---:|" * (len(rows[0]) - 2)
    for row in rows[1:]:
        yield "| " + " | ".join(row) + " |"


def page(found):
    """The tables as Markdown."""
    yield f"### {found['device']}"
    yield ""
    yield f"{found['driver']}; {found['voxels']}³, frames from scratch, milliseconds of the device, median of five; less is better."
    yield f"`rel` and energy: of the whole image at {ERROR_SIZE.replace('x', '×')} against the path tracer with as many bounces."
    yield ""
    sizes = found["sizes"]
    rows = [["scene", "preset", *(f"{size.replace('x', '×')}" for size in sizes), "`rel`", "energy"]]
    for row in found["rows"]:
        error = row["error"] or {}
        rows.append([row["scene"], f"`{row['preset']}`", *(milliseconds((row["times"][size] or {}).get("frame")) for size in sizes),
                     *(f"{error[key]:.3f}" if key in error else "–" for key in ("rel", "energy"))])
    yield from table(rows)
    yield ""
    yield f"Pass by pass at {sizes[0].replace('x', '×')}:"
    yield ""
    first = [(row, row["times"][sizes[0]]) for row in found["rows"] if row["times"][sizes[0]]]
    for row, times in first:
        passes = ", ".join(f"{name} {milliseconds(ms)}" for name, ms in times["passes"].items() if ms >= 0.01)
        yield f"- {row['scene']}, `{row['preset']}`: {passes}."


def main():
    parser = argparse.ArgumentParser(description="Measures the presets' passes and errors on a device: the tables of docs/gpu.md")
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "out/gpu", help="folder for gpu.json and gpu.md")
    parser.add_argument("--atrium", type=pathlib.Path, help="one more scene, such as a large atrium")
    parser.add_argument("--device", help="the device to use, as twobounce info lists them")
    parser.add_argument("--seconds", type=float, default=230.0, help="how long it may take in all [230]")
    parser.add_argument("--sizes", default=",".join(SIZES), help="image sizes, separated by commas")
    parser.add_argument("--presets", default=",".join(PRESETS), help="presets, separated by commas")
    parser.add_argument("--voxels", type=int, default=128, help="edge of the grid [128]")
    parser.add_argument("--triangles", type=int, default=1_000_000, help="of the terrain [1000000]")
    options = parser.parse_args()
    sizes, presets = options.sizes.split(","), options.presets.split(",")
    run = Run(options.seconds, options.device or os.environ.get("TWOBOUNCE_DEVICE"))
    options.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        terrain = folder / "terrain.glb"
        write_terrain(terrain, max(1, round(math.sqrt(options.triangles / 2))))
        scenes = {"box": ROOT / "assets/cornell-point.glb", "gallery": ROOT / "assets/gallery.glb",
                  f"hills, {options.triangles:,} triangles": terrain}
        if options.atrium:
            scenes["atrium"] = options.atrium
        rows = [{"scene": scene, "preset": preset, "times": dict.fromkeys(sizes), "error": None}
                for scene in scenes for preset in presets]
        found = {"device": "", "driver": "", "voxels": options.voxels, "sizes": sizes, "rows": rows}
        keep = options.seconds * (1.0 - SHARE_OF_TIMES)
        for size in sizes:
            for row in rows:
                done = timed(run, scenes[row["scene"]], size, row["preset"], options.voxels, folder, keep)
                if done:
                    passes = {}
                    for one in done["passes"]:
                        passes[one["name"]] = passes.get(one["name"], 0.0) + one["gpu_ms"]["median"]
                    row["times"][size] = {"frame": done["frame_gpu_ms"]["median"], "wall": done["frame_wall_ms"]["median"],
                                          "bytes": done["memory"]["allocated_bytes"], "passes": passes}
                    found["device"], found["driver"] = done["device"], done["driver"]
        for scene, file in scenes.items():
            reference = folder / "reference.exr"
            if run("reference", file, "-o", reference, "--size", ERROR_SIZE, "--depth", "2", "--noise", "4", "-q"):
                for row in (row for row in rows if row["scene"] == scene):
                    row["error"] = errors(run, file, row["preset"], options.voxels, folder, reference)
    if not found["device"]:
        sys.exit("gpu-table: nothing was measured: run target/release/twobounce info to see why, or allow more time with --seconds")
    (options.output / "gpu.json").write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n")
    (options.output / "gpu.md").write_text("\n".join(page(found)) + "\n")
    print(f"wrote {options.output / 'gpu.json'} and {options.output / 'gpu.md'}")


if __name__ == "__main__":
    main()
