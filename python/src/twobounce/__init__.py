"""Global illumination with two bounces or all of them, for any glTF 2.0 scene, as numpy arrays.

    import twobounce

    image = twobounce.render("model.glb", size=(640, 360))
    image.save("model.png")              # exposed and tone-mapped; an .exr has the radiance itself
    radiance = image.radiance            # numpy, float32, height × width × 3, linear Rec. 709

:func:`render` does what the command ``twobounce render`` does, :func:`path_trace` what ``twobounce reference`` does,
and :meth:`Image.compare` has the project's one definition of an error (``docs/accuracy.md``). A device is a GPU or
Mesa's lavapipe.
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Mapping
from typing import Any, Optional, Sequence, Union

import numpy as np

from . import _core
from ._core import PRESETS, Error

__all__ = ["PRESETS", "Error", "Image", "Scene", "path_trace", "read_rows", "render", "settings"]

_Path = Union[str, os.PathLike]
_Vector = Sequence[float]


class Image:
    """A picture: linear radiance, further layers, and what is known about it. :func:`render` and :func:`path_trace`
    make them."""

    def __init__(self, core: _core.Image) -> None:
        self._core = core

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._core.size

    @property
    def radiance(self) -> np.ndarray:
        """Linear radiance, float32, shape (height, width, 3), rows from the top. It is read-only, and no copy."""
        return self.layer("beauty")

    @property
    def layers(self) -> dict[str, np.ndarray]:
        """Every layer by its name, ``beauty`` among them: as :attr:`radiance`."""
        return {name: self.layer(name) for name in self._core.layers}

    def layer(self, name: str) -> np.ndarray:
        """A layer by its name; KeyError if it was not asked for."""
        return np.asarray(self._core.pixels(name))

    @property
    def shown(self) -> np.ndarray:
        """8-bit sRGB as :meth:`save` shows it: uint8, shape (height, width, 3)."""
        width, height = self.size
        return np.frombuffer(self._core.shown(), np.uint8).reshape(height, width, 3)

    @property
    def exposure(self) -> float:
        """Stops with which a .png is shown: radiance is multiplied by 2 to this power."""
        return self._core.exposure

    @property
    def notes(self) -> list[str]:
        """Sentences about what was ignored, simplified or added, and about what may be wrong with the picture."""
        return self._core.notes

    @property
    def noise(self) -> Optional[float]:
        """By the picture's own estimate, the root mean square of its pixels' relative error; None for a single
        pass."""
        return self._core.noise

    @property
    def settings(self) -> Optional[str]:
        """The settings that it was rendered with, as a TOML file; None for a traced picture."""
        return self._core.settings

    def save(self, path: _Path) -> None:
        """Writes a .png or .jpg, exposed and tone-mapped, or an .exr of linear radiance with all layers."""
        self._core.save(os.fspath(path))

    def compare(self, reference: Image) -> dict[str, Any]:
        """The errors against a reference of the same size. ``total`` has ``energy``, ``rel``, ``relmse`` and
        ``p95``, ``flip`` is a number. ``indirect`` and ``indirect_diffuse`` are as ``total``, of the indirect light
        by itself; they need the layer ``direct`` in both pictures (and ``diffuse`` in the reference) and are None
        without. ``nonfinite`` counts values that are left out, of both."""
        return self._core.compare(reference._core)

    def _repr_png_(self) -> bytes:
        # Notebooks display pictures by this method.
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "image.png")
            self.save(path)
            with open(path, "rb") as file:
                return file.read()

    def __repr__(self) -> str:
        width, height = self.size
        noise = "" if self.noise is None else f", noise {100 * self.noise:.2f} %"
        return f"<twobounce.Image {width}x{height}, {', '.join(self._core.layers)}{noise}>"


class Scene:
    """A scene: opened from a glTF 2.0 file, or made of arrays. Lengths are metres, +Y is up, axes are right-handed."""

    def __init__(self, name: str = "scene") -> None:
        self._core = _core.Scene(name)

    @classmethod
    def open(cls, path: _Path) -> Scene:
        """Reads a .glb or .gltf."""
        scene = cls.__new__(cls)
        scene._core = _core.Scene.open(os.fspath(path))
        return scene

    @property
    def name(self) -> str:
        return self._core.name

    @property
    def triangles(self) -> int:
        """Triangles over all instances."""
        return self._core.triangles

    @property
    def cameras(self) -> list[str]:
        """The cameras' names."""
        return self._core.cameras

    @property
    def animations(self) -> list[tuple[str, float]]:
        """The animations' names and seconds."""
        return self._core.animations

    @property
    def warnings(self) -> list[str]:
        """A sentence for everything that the loader ignored or simplified."""
        return self._core.warnings

    def add_material(
        self,
        base_color: _Vector = (0.8, 0.8, 0.8),
        *,
        metallic: float = 0.0,
        roughness: float = 1.0,
        emissive: _Vector = (0.0, 0.0, 0.0),
        transmission: float = 0.0,
        ior: float = 1.5,
        thickness: float = 0.0,
        double_sided: bool = False,
        texture: Optional[int] = None,
        name: str = "material",
    ) -> int:
        """Adds a material of glTF's metallic-roughness model and returns its index. ``base_color`` is linear, with
        alpha or without; ``emissive`` is radiance; ``thickness`` above 0 makes transmission a volume; ``texture``:
        of :meth:`add_texture`."""
        color = [float(value) for value in base_color]
        color += [1.0] * (4 - len(color))
        numbers = [*color, *map(float, emissive), metallic, roughness, transmission, ior, thickness]
        return self._core.add_material(name, numbers, double_sided, texture)

    def add_texture(self, pixels: Any) -> int:
        """Adds a texture of 8-bit sRGB, shape (height, width, 3 or 4), rows from the top, and returns its index."""
        pixels = np.asarray(pixels)
        if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or 0 in pixels.shape:
            raise Error("a texture is a uint8 array of the shape (height, width, 3 or 4)")
        height, width, channels = pixels.shape
        if channels == 3:
            pixels = np.concatenate([pixels, np.full((height, width, 1), 255, np.uint8)], axis=2)
        return self._core.add_texture(width, height, pixels.tobytes())

    def add_mesh(
        self,
        positions: Any,
        indices: Any,
        material: int,
        *,
        normals: Any = None,
        uvs: Any = None,
        transform: Any = None,
    ) -> int:
        """Adds triangles and returns their instance's index. ``positions``: (vertices, 3); ``indices``: (triangles,
        3); ``normals``: as positions, flat ones without; ``uvs``: (vertices, 2); ``transform``: 4 × 4 or 3 × 4, to
        the world."""
        positions = _floats("positions", positions, 3)
        indices = np.asarray(indices)
        if indices.ndim != 2 or indices.shape[1] != 3 or not np.issubdtype(indices.dtype, np.integer):
            raise Error("indices are an array of integers of the shape (triangles, 3)")
        if indices.size and (indices.min() < 0 or indices.max() >= len(positions)):
            raise Error("a mesh has an index beyond its vertices")
        arrays = [positions]
        for name, array, width in (("normals", normals, 3), ("uvs", uvs, 2)):
            array = np.empty((0, width), np.float32) if array is None else _floats(name, array, width)
            if len(array) not in (0, len(positions)):
                raise Error(f"{name} are {len(array)}, positions {len(positions)}: give one of each vertex")
            arrays.append(array)
        matrix = np.eye(4) if transform is None else np.asarray(transform, np.float64)
        if matrix.shape not in ((4, 4), (3, 4)):
            raise Error("a transform is a matrix of 4 × 4 or 3 × 4")
        packed = tuple(array.tobytes() for array in (*arrays, np.ascontiguousarray(indices, np.uint32)))
        return self._core.add_mesh(packed, material, matrix[:3].tolist())

    def add_light(
        self,
        intensity: _Vector,
        *,
        position: Optional[_Vector] = None,
        direction: Optional[_Vector] = None,
        cone: Optional[tuple[float, float]] = None,
        radius: float = 0.0,
    ) -> int:
        """Adds a light and returns its index: a point light at ``position``, a spot light with ``direction`` and a
        ``cone`` (inner and outer half angle in radians) too, a directional light with ``direction`` alone.
        ``intensity``: irradiance at one metre, or the irradiance of a directional light. ``radius`` in metres
        softens shadows."""
        if position is None and direction is None:
            raise Error("a light has a position, a direction or both")
        if cone is not None and (position is None or direction is None):
            raise Error("a spot light has a position and a direction")
        where, along, angles = (None if v is None else list(map(float, v)) for v in (position, direction, cone))
        return self._core.add_light(list(map(float, intensity)), (where, along), angles, radius)

    def add_camera(
        self, eye: _Vector, target: _Vector, *, up: _Vector = (0.0, 1.0, 0.0), fov: float = 45.0
    ) -> int:
        """Adds a camera and returns its index. ``fov``: vertical, in degrees."""
        _check_look(eye, target, up, fov)
        return self._core.add_camera(list(map(float, eye)), list(map(float, target)), list(map(float, up)), fov)

    def __repr__(self) -> str:
        return f"<twobounce.Scene {self.name!r}, {self.triangles} triangles>"


def render(
    scene: Union[Scene, _Path],
    *,
    preset: str = "balanced",
    settings: Mapping[str, Any] = {},
    size: tuple[int, int] = (1280, 720),
    noise: Optional[float] = None,
    refine: bool = True,
    time_limit: Optional[float] = None,
    progress: Optional[Callable[[int, Optional[int]], object]] = None,
    device: Optional[str] = None,
    memory_limit: Optional[int] = None,
    validation: bool = False,
    **look: Any,
) -> Image:
    """Renders a scene, or the scene in a file.

    preset: one of :data:`PRESETS`. settings: keys that differ, such as ``{"voxels": 64, "method": "cones"}``;
    :func:`settings` shows all. size: width and height in pixels. noise: passes are added until the root mean square
    of the pixels' relative error is at most this share (0.02 by default); with ``refine=False`` there is one pass,
    or ``image.passes``. time_limit: no pass begins after this many seconds. progress: is called before each pass with
    the number of passes and about how many it takes, None at first; an exception there, as Ctrl-C, ends the work
    and is raised. device: a name or an index; memory_limit: bytes; validation: with Vulkan's layers.

    look, in both :func:`render` and :func:`path_trace`: camera (a name or an index of the file) or eye, target and
    up; fov (degrees); time (seconds), animation (a name, an index, ``all``), loop; sky (radiance (r, g, b), or an
    .hdr or .exr), sky_intensity, sky_rotation (degrees); default_light and ground (``auto``, ``on``, ``off``);
    layers (``direct``, ``indirect``, ``ao``, ``normal``, ``depth``, ``albedo``, ``diffuse``); transparent; tone
    (``neutral``, ``agx``, ``reinhard``, ``linear``); exposure (stops).
    """
    sets = [f"{key}={_toml(value)}" for key, value in settings.items()]
    options = _look(size, look)
    options.update(preset=preset, settings=sets, noise=noise, refine=refine, time_limit=time_limit)
    options.update(device=device, memory_limit=memory_limit, validation=validation)
    return Image(_core.render(_scene(scene), options, progress))


def path_trace(
    scene: Union[Scene, _Path],
    *,
    size: tuple[int, int] = (1280, 720),
    bounces: Optional[int] = 2,
    samples: Optional[int] = None,
    noise: float = 0.01,
    seed: int = 0,
    keep: bool = False,
    progress: Optional[Callable[[float, Optional[float]], object]] = None,
    **look: Any,
) -> Image:
    """Traces a reference on the CPU, without a bias.

    bounces: of indirect light, all with None. samples: a pixel, 2 or more; without, as many as bring the noise, a
    share, to ``noise``. keep: takes samples from the cache of ``twobounce reference``, and keeps them there.
    progress: is called with the share that is traced and the noise, None at first. look: as for :func:`render`.
    """
    options = _look(size, look)
    traced = _core.path_trace(
        _scene(scene), options, bounces=bounces, samples=samples, noise=noise, seed=seed, keep=keep, progress=progress
    )
    return Image(traced)


def settings(preset: str = "balanced") -> str:
    """Every key of a preset's settings, as a TOML file."""
    return _core.settings(preset)


def read_rows(path: _Path) -> list[dict[str, Any]]:
    """The rows of a chart or a study: a folder that ``twobounce chart`` or ``twobounce study`` wrote, or its
    rows.json or rows.csv."""
    path = os.fspath(path)
    if os.path.isdir(path):
        found = [os.path.join(path, name) for name in ("rows.json", "rows.csv")]
        path = next((name for name in found if os.path.exists(name)), found[0])
    try:
        with open(path, encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file)) if path.endswith(".csv") else json.load(file)["rows"]
    except (OSError, ValueError, KeyError) as problem:
        raise Error(f"{path}: is no rows of a chart ({problem})") from problem


_LOOK = frozenset(
    "camera eye target up fov time animation loop sky sky_intensity sky_rotation default_light ground layers transparent"
    " tone exposure".split()
)


def _look(size: Any, look: dict[str, Any]) -> dict[str, Any]:
    """The view and the light, in the form that the native part takes."""
    unknown = sorted(set(look) - _LOOK)
    if unknown:
        raise TypeError(f"there is no keyword {unknown[0]!r}; there are {', '.join(sorted(_LOOK))}")
    options = {key: value for key, value in look.items() if key not in ("eye", "target", "up", "camera", "sky")}
    options["size"] = _size(size)
    eye, target, camera = look.get("eye"), look.get("target"), look.get("camera")
    if (eye is None) != (target is None):
        raise Error("eye and target belong together; give both")
    if eye is not None and target is not None:
        if camera is not None:
            raise Error("camera is one of the file, eye and target are another; give one of them")
        look_at = {"eye": eye, "target": target, "up": look.get("up", (0.0, 1.0, 0.0))}
        options["look_at"] = tuple(_three(name, vector) for name, vector in look_at.items())
    if camera is not None:
        options["camera"] = str(camera)
    for key in ("animation", "device"):
        if options.get(key) is not None:
            options[key] = str(options[key])
    sky = look.get("sky")
    if isinstance(sky, (str, os.PathLike)):
        options["sky_map"] = os.fspath(sky)
    elif sky is not None:
        options["sky"] = _three("sky", sky)
    options["layers"] = list(look.get("layers", ()))
    return options


def _size(size: Any) -> tuple[int, int]:
    try:
        width, height = (int(side) for side in size)
        if (width, height) == tuple(size) and 1 <= width <= 16384 and 1 <= height <= 16384:
            return width, height
    except (TypeError, ValueError, OverflowError):
        pass
    raise Error(f"a picture's size is two whole numbers from 1 to 16384, not {size!r}")


def _three(name: str, vector: Any) -> list[float]:
    try:
        numbers = [float(number) for number in vector]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) != 3:
        raise Error(f"{name} is three numbers, not {vector!r}")
    return numbers


def _scene(scene: Union[Scene, _Path]) -> _core.Scene:
    return (scene if isinstance(scene, Scene) else Scene.open(scene))._core


def _floats(name: str, array: Any, width: int) -> np.ndarray:
    array = np.ascontiguousarray(array, np.float32)
    if array.ndim != 2 or array.shape[1] != width:
        raise Error(f"{name} are an array of the shape (vertices, {width})")
    return array


def _check_look(eye: _Vector, target: _Vector, up: _Vector, fov: float) -> None:
    forward = np.subtract(target, eye).astype(np.float64)
    is_finite = np.isfinite([*eye, *target, *up, fov]).all()
    if not is_finite or not 0 < fov < 180 or np.linalg.norm(np.cross(forward, up)) <= 1e-6 * np.linalg.norm(forward):
        raise Error("a camera has an eye, another target, an up not along the view, and a fov between 0 and 180 degrees")


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return str(value)
