"""Makes metrics_values.json: what the metrics must give for two synthetic images.

Needs numpy and flip-evaluator (NVIDIA's own Python package of FLIP). The images are exact in float32; the test makes
the same ones.
"""

import json
import pathlib

import flip_evaluator
import numpy as np

W, H = 96, 64
y, x, c = np.meshgrid(np.arange(H), np.arange(W), np.arange(3), indexing="ij")
reference = ((x * x + 3 * y * y + 5 * c) // 40 % 61 + 1) / 32
reference_direct = reference * ((x + y) % 4) / 8
image = reference + ((7 * x + 11 * y + 3 * c) % 17 - 6) / 256
image_direct = reference_direct + ((5 * x + 3 * y + c) % 7 - 3) / 512


def metrics(a, b):
    mean = b.mean()
    relmse = ((a - b) ** 2).sum(-1) / ((b**2).sum(-1) + 3 * 0.01 * mean**2)
    relative = np.abs(a - b).sum(-1) / (b.sum(-1) + 3 * 0.01 * mean)
    return {
        "energy": a.mean() / mean,
        "rel": np.abs(a - b).mean() / mean,
        "relmse": relmse.mean(),
        "p95": np.percentile(relative, 95),
    }


luminance = reference @ np.array([0.2126, 0.7152, 0.0722])
exposure = 0.8 / np.percentile(luminance, 95)


def ldr(linear):
    v = np.clip(linear * exposure, 0, 1)
    srgb = np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)
    return (np.round(srgb * 255) / 255).astype(np.float32)


_, flip, _ = flip_evaluator.evaluate(ldr(reference), ldr(image), "LDR", parameters={"ppd": 67.0})
values = {
    "total": metrics(image, reference),
    "indirect": metrics(image - image_direct, reference - reference_direct),
    "exposure": exposure,
    "flip": flip,
}
path = pathlib.Path(__file__).with_suffix(".json")
path.write_text(json.dumps(values, indent=2, default=float) + "\n")
