"""Pictures of scenes, as numpy arrays."""

import gc

import numpy as np
import pytest
from conftest import ROOT, SMALL

import twobounce


def test_a_picture_is_a_view_of_the_renderers_memory(box):
    image = twobounce.render(box, **SMALL, layers=["depth", "direct"])
    assert image.size == (48, 32) and image.noise <= 0.1
    radiance = image.radiance
    assert radiance.shape == (32, 48, 3) and radiance.dtype == np.float32 and not radiance.flags.writeable
    assert np.shares_memory(radiance, image.radiance), "a layer is copied"
    assert list(image.layers) == ["beauty", "direct", "depth"]
    assert np.isfinite(radiance).all() and radiance.mean() > 0.05
    with pytest.raises(KeyError):
        image.layer("normal")
    # Pixels outlive their picture.
    before = radiance.copy()
    del image
    gc.collect()
    np.testing.assert_array_equal(radiance, before)


def test_a_file_has_the_arrays_values(box, tmp_path):
    image = twobounce.render(ROOT / "assets/cornell-area.glb", **SMALL)
    image.save(tmp_path / "a.png")
    again = twobounce.render(box, **SMALL)
    again.save(tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    np.testing.assert_array_equal(image.radiance, again.radiance)
    assert image.shown.shape == (32, 48, 3) and image.shown.dtype == np.uint8
    # A grey pixel within the curve's straight part is the exposed radiance, encoded by sRGB.
    linear = image.radiance * np.float32(2.0**image.exposure)
    brighter = linear.sum(axis=2).ravel().argsort()
    assert image.shown.reshape(-1, 3)[brighter[-1]].sum() > image.shown.reshape(-1, 3)[brighter[0]].sum()
    assert image._repr_png_()[:4] == b"\x89PNG"
    with pytest.raises(twobounce.Error, match="unknown ending"):
        image.save(tmp_path / "a.gif")
    assert "passes = " in image.settings and "0x" not in repr(image)


def test_a_picture_is_near_its_reference(room):
    truth = twobounce.path_trace(room, size=(48, 32), samples=64, layers=["direct", "diffuse"])
    image = twobounce.render(room, **{**SMALL, "noise": 0.05}, layers=["direct"])
    errors = image.compare(truth)
    assert errors["total"]["rel"] < 0.1 and abs(errors["indirect"]["energy"] - 1) < 0.1, errors
    assert errors["indirect_diffuse"]["rel"] > 0 and errors["nonfinite"] == (0, 0)
    assert truth.compare(truth)["total"]["rel"] == 0
    assert truth.settings is None and 0 < truth.noise < 0.2


def test_a_closed_room_has_the_light_of_its_sum(room):
    """Walls that reflect half of the light: all light is about twice the direct light."""
    direct, all_light = (twobounce.path_trace(room, size=(32, 32), samples=64, bounces=n) for n in (0, None))
    ratio = all_light.radiance.mean() / direct.radiance.mean()
    assert 1.3 < ratio < 2.5, ratio


def test_arrays_make_the_scene_of_a_file(tmp_path):
    scene = twobounce.Scene("card")
    pixels = np.zeros((2, 2, 3), np.uint8)
    pixels[:, 0] = (255, 0, 0)
    texture = scene.add_texture(pixels)
    card = scene.add_material((1, 1, 1), texture=texture, double_sided=True)
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    uvs = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    moved = np.eye(4)
    moved[:3, 3] = (0, 0, -1)
    for kind in (normals, None):
        scene.add_mesh(corners, [[0, 1, 2], [0, 2, 3]], card, normals=kind, uvs=uvs, transform=moved)
    scene.add_light((3, 3, 3), direction=(0, 0, -1))
    scene.add_light((9, 9, 9), position=(0, 0, 2), direction=(0, 0, -1), cone=(0.3, 0.5), radius=0.1)
    assert scene.triangles == 4
    look = dict(eye=(0, 0, 3), target=(0, 0, 0), layers=["albedo"])
    image = twobounce.path_trace(scene, size=(32, 32), samples=8, **look)
    albedo = image.layer("albedo")
    assert albedo[16, 10, 0] > 0.9 and albedo[16, 21, 0] < 0.1, "the texture's red half is on the left"
    assert image.radiance[16, 10, 0] > 0.1 > image.radiance[16, 10, 1]


def test_the_same_call_gives_the_same_bits(box):
    first, second = (twobounce.render(box, **SMALL).radiance for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_rows_of_a_chart_are_dictionaries():
    rows = twobounce.read_rows(ROOT / "docs/notes/study")
    assert len(rows) > 10 and all(isinstance(row, dict) for row in rows)
    with pytest.raises(twobounce.Error, match="no rows"):
        twobounce.read_rows(ROOT / "docs")
