"""Scenes for the tests, and options that are small and validated."""

import pathlib

import numpy as np
import pytest

import twobounce

ROOT = pathlib.Path(__file__).resolve().parents[2]
SMALL = dict(preset="fast", size=(48, 32), settings={"voxels": 16}, validation=True, noise=0.1)


@pytest.fixture
def box():
    return twobounce.Scene.open(ROOT / "assets/cornell-area.glb")


@pytest.fixture
def room():
    """A closed white room of four metres, lit by a square of its ceiling."""
    scene = twobounce.Scene("room")
    white = scene.add_material((0.5, 0.5, 0.5), double_sided=True)
    lamp = scene.add_material((0, 0, 0), emissive=(10, 10, 10))
    corners = np.array([[x, y, z] for x in (-2, 2) for y in (0, 4) for z in (-2, 2)], np.float32)
    # Each side as two triangles.
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    scene.add_mesh(corners, [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))], white)
    square = [[-0.5, 3.99, -0.5], [0.5, 3.99, -0.5], [0.5, 3.99, 0.5], [-0.5, 3.99, 0.5]]
    scene.add_mesh(square, [[0, 1, 2], [0, 2, 3]], lamp)
    scene.add_camera((0, 2, 1.9), (0, 1.5, -2), fov=70)
    return scene
