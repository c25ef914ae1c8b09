"""Meshes of a kept scene for a Rerun recording, in the colours that the images show them in."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int32, UInt8

from perpetua.formats.source import ExportSource
from perpetua.scene.actor import ActorMesh, ActorPart
from perpetua.scene.scene import Scene

# What stands between an eye outside and the room; the viewer starts without it.
SHELL = frozenset({"ceiling", "wall"})
UNSEEN: tuple[int, int, int] = (150, 150, 150)
COLOUR_FRAMES = 4
SRGB_POWER = 1.0 / 2.2


@dataclass(frozen=True)
class StillMesh:
    """An object of the room, of one colour, under its path in the recording."""

    path: str
    vertices_m: Float64[np.ndarray, "P 3"]
    faces: Int32[np.ndarray, "F 3"]
    colour: tuple[int, int, int]


def still_meshes(source: ExportSource, meshes: Scene) -> Iterator[StillMesh]:
    """The objects of a room; those of its shell below ``shell``, the others below ``room``."""
    colours = _seen_colours(source)
    for obj in meshes.room.objects:
        if len(obj.mesh.faces):
            group = "shell" if obj.category in SHELL else "room"
            path = f"world/{group}/{entity_name(source, obj.object_index)}"
            colour = colours.get(obj.object_index, UNSEEN)
            yield StillMesh(path, obj.mesh.vertices_m, obj.mesh.faces, colour)


def entity_name(source: ExportSource, index: int) -> str:
    """The name of an object in a form that can be part of an entity path; unlike all others."""
    name = source.object_name.get(index, f"object_{index}")
    plain = "".join(letter if letter.isascii() and (letter.isalnum() or letter in "_-") else "_" for letter in name)
    return plain if plain == name else f"{plain}_{index}"


def _seen_colours(source: ExportSource) -> dict[int, tuple[int, int, int]]:
    """The mean colour of each object in some frames of all views; nothing where no object index is kept."""
    sums, counts = np.zeros((2**16, 3)), np.zeros(2**16)
    frames = np.unique(np.linspace(0, len(source.sequence.tracks_m) - 1, COLOUR_FRAMES).astype(int)).tolist()
    for view, rendered in zip(source.sequence.views, source.object_index or (), strict=False):
        for frame in frames:
            index, rgb = np.asarray(rendered[frame]).ravel(), view.image(frame).reshape(-1, 3)
            counts += np.bincount(index, minlength=2**16)
            for channel in range(3):
                sums[:, channel] += np.bincount(index, rgb[:, channel], minlength=2**16)
    seen = np.flatnonzero(counts)
    means = np.rint(sums[seen] / counts[seen, None]).astype(int)
    return {index: (r, g, b) for index, (r, g, b) in zip(seen.tolist(), means.tolist(), strict=True)}


def vertex_colours(actor: ActorMesh) -> UInt8[np.ndarray, "P 3"]:
    """The colour of each vertex of an actor, read from its parts' textures."""
    colours = np.full((actor.vertices_m.shape[1], 3), UNSEEN, np.uint8)
    for part in actor.parts:
        colours[part.faces.ravel()] = _corner_colours(part)
    return colours


def _corner_colours(part: ActorPart) -> UInt8[np.ndarray, "N 3"]:
    image = part.material.image
    if image is None:
        flat = np.rint(255.0 * np.clip(part.material.base_color, 0.0, 1.0) ** SRGB_POWER).astype(np.uint8)
        return np.tile(flat, (part.faces.size, 1))
    uv = part.uv.reshape(-1, 2) % 1.0
    height_px, width_px = image.shape[:2]
    column = (uv[:, 0] * width_px).astype(int).clip(0, width_px - 1)
    # Row 0 is on top, and V runs up.
    row = ((1.0 - uv[:, 1]) * height_px).astype(int).clip(0, height_px - 1)
    return np.asarray(image[row, column], np.uint8)


def vertex_normals(vertices_m: Float32[np.ndarray, "P 3"], faces: Int32[np.ndarray, "F 3"]) -> np.ndarray:
    """Unit normals for shading, the mean of the faces around a vertex by area; float32, P by 3."""
    corner_m = np.asarray(vertices_m, np.float64)[faces]
    across = np.cross(corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0])
    total = np.stack(
        [np.bincount(faces.ravel(), np.repeat(across[:, axis], 3), minlength=len(vertices_m)) for axis in range(3)],
        axis=1,
    )
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return (total / np.maximum(length, 1e-30)).astype(np.float32)
