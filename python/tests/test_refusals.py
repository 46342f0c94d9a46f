"""Work that is refused, and work that is ended."""

import os
import signal
import threading
import time

import numpy as np
import pytest
from conftest import ROOT, SMALL

import twobounce

NAN = float("nan")


@pytest.mark.parametrize(
    "words, change",
    [
        ("16384", dict(size=(0, 4))),
        ("16384", dict(size=(4.5, 4))),
        ("16384", dict(size="abc")),
        ("16384", dict(size=(8, 8, 8))),
        ("eye is three numbers", dict(eye=(1, 2), target=(0, 0, 0))),
        ("sky is three numbers", dict(sky=1.0)),
        ("preset", dict(preset="fastest")),
        ("voxels", dict(settings={"voxels": 7})),
        ("no setting", dict(settings={"nonsense": 1})),
        ('layers: "heat" is none of', dict(layers=["heat"])),
        ('tone: "film" is none of', dict(tone="film")),
        ('default_light: "maybe"', dict(default_light="maybe")),
        ("exposure", dict(exposure=NAN)),
        ("exposure: .*number", dict(exposure="bright")),
        ("0 and 180", dict(fov=0)),
        ("at least 0", dict(time=-1)),
        ("at least 0", dict(sky=(-1, 0, 0))),
        ("time_limit", dict(time_limit=-1)),
        ("camera", dict(camera="nobody")),
        ("same point", dict(eye=(0, 0, 0), target=(0, 0, 0))),
        ("give both", dict(eye=(0, 0, 0))),
        ("above 0", dict(noise=0)),
        ("device", dict(device="nothing like this")),
    ],
)
def test_values_that_make_no_sense_are_one_sentence(box, words, change):
    with pytest.raises(twobounce.Error, match=words) as caught:
        twobounce.render(box, **{**SMALL, **change})
    assert "\n" not in str(caught.value)


def test_an_unknown_keyword_is_named(box):
    with pytest.raises(TypeError, match="eyes"):
        twobounce.render(box, eyes=(0, 0, 0))


def test_files_are_refused(tmp_path):
    with pytest.raises(twobounce.Error, match="nothing.glb"):
        twobounce.render(tmp_path / "nothing.glb")
    (tmp_path / "text.glb").write_text("text")
    with pytest.raises(twobounce.Error, match="text.glb"):
        twobounce.Scene.open(tmp_path / "text.glb")


def test_arrays_that_fit_no_mesh_are_refused():
    scene = twobounce.Scene()
    corners = np.zeros((3, 3), np.float32)
    material = scene.add_material()
    cases = [
        ("beyond its vertices", lambda: scene.add_mesh(corners, [[0, 1, 3]], material)),
        ("integers", lambda: scene.add_mesh(corners, [[0.5, 1, 2]], material)),
        ("shape", lambda: scene.add_mesh(corners[:, :2], [[0, 1, 2]], material)),
        ("material", lambda: scene.add_mesh(corners, [[0, 1, 2]], 7)),
        ("uvs are 2", lambda: scene.add_mesh(corners, [[0, 1, 2]], material, uvs=np.zeros((2, 2)))),
        ("4 × 4", lambda: scene.add_mesh(corners, [[0, 1, 2]], material, transform=np.eye(2))),
        ("uint8", lambda: scene.add_texture(np.zeros((2, 2, 3)))),
        ("direction", lambda: scene.add_light((1, 1, 1))),
        ("zero", lambda: scene.add_light((1, 1, 1), direction=(0, 0, 0))),
        ("camera", lambda: scene.add_camera((0, 0, 0), (0, 1, 0))),
        ("texture", lambda: scene.add_material(texture=0)),
    ]
    for words, call in cases:
        with pytest.raises(twobounce.Error, match=words):
            call()
    # A scene with NaN is refused when it is rendered.
    scene.add_mesh(np.full((3, 3), NAN), [[0, 1, 2]], material)
    with pytest.raises(twobounce.Error):
        twobounce.render(scene, **SMALL)


def test_progress_is_told_and_its_exception_ends_the_work(box):
    told = []
    twobounce.render(box, **SMALL, progress=lambda has, needed: told.append((has, needed)))
    assert told[:3] == [(0, None), (1, None), (2, told[2][1])] and told[2][1] > 2

    class Enough(Exception):
        pass

    def stop(has, needed):
        if has == 2:
            raise Enough

    with pytest.raises(Enough):
        twobounce.render(box, **{**SMALL, "noise": 0.001}, progress=stop)
    shares = []
    twobounce.path_trace(box, size=(32, 32), samples=16, progress=lambda share, noise: shares.append(share))
    assert shares == sorted(shares) and shares[-1] == 1


@pytest.mark.parametrize("work", ["render", "path_trace"])
def test_ctrl_c_ends_the_work(box, work):
    threading.Timer(1, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        if work == "render":
            twobounce.render(box, **{**SMALL, "noise": 1e-6})
        else:
            twobounce.path_trace(box, size=(256, 256), samples=1 << 20)
    assert time.monotonic() - began < 4


def test_other_threads_go_on_meanwhile(box):
    ticks, ended = [], threading.Event()

    def tick():
        while not ended.wait(0.01):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.monotonic()
    twobounce.path_trace(box, size=(128, 128), samples=32)
    took = time.monotonic() - began
    ended.set()
    thread.join()
    assert len(ticks) > 5 * took, f"{len(ticks)} ticks in {took} s"
    assert ROOT.exists()
