"""What is sewn on to garments: plackets with buttons, pockets, belts."""

import numpy as np
from jaxtyping import Float32, Float64

from perpetua.actors.base.piece import Piece, Surface
from perpetua.actors.base.surface import positive, vertex_normals
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material

_BUTTON_RADIUS_M, _BUTTON_STEP_M, _BUTTON_CORNERS = 0.0055, 0.085, 10
_PLACKET_HALF_M = 0.016


def patch(
    cloth: Surface, field_m: Float64[np.ndarray, " P"], lift_m: float, name: str, shade: Material, tile_m: float
) -> tuple[Piece, Float64[np.ndarray, "Q 3"]]:
    """A second layer of cloth where a field is positive, ``lift_m`` above the first.

    Its grain runs straight up; ``tile_m`` is the size of the fabric's image.

    Returns:
        The piece, and the places of its vertices on the base mesh.
    """
    cut, _ = positive(cloth, field_m)
    raised_m = cut.vertices_m + lift_m * vertex_normals(cut.vertices_m, cut.faces)
    uv: Float32[np.ndarray, "F 3 2"] = (cut.template_m[:, [1, 2]][cut.faces] / tile_m).astype(np.float32)
    return Piece(raised_m, cut.weights, (ActorPart(name, cut.faces, uv, shade),)), cut.template_m


def placket(
    cloth: Surface, front: Float64[np.ndarray, " P"], to_z_m: float, shade: Material, tile_m: float
) -> tuple[Piece, Float64[np.ndarray, "Q 3"]]:
    """The strip that carries the buttons, down the middle of the front to a height on the base mesh.

    Args:
        cloth: the outer side of the garment.
        front: positive in front.
        to_z_m: lower end on the base mesh.
        shade: the garment's material.
        tile_m: size of its fabric's image.
    """
    side_m, height_m = cloth.template_m[:, 1], cloth.template_m[:, 2]
    field_m = np.minimum(_PLACKET_HALF_M - np.abs(side_m), np.minimum(height_m - to_z_m, front))
    return patch(cloth, field_m, 0.0016, "placket", shade, tile_m)


def buttons(strip: Piece, strip_template_m: Float64[np.ndarray, "P 3"], shade: Material) -> Piece:
    """Buttons down the middle of a placket, each a small disc that lies on it.

    Args:
        strip: the placket.
        strip_template_m: its vertices' places on the base mesh.
        shade: the buttons' material.
    """
    height_m = strip_template_m[:, 2]
    normal = vertex_normals(strip.vertices_m, strip.parts[0].faces)
    vertices, weights, faces, uv = [], [], [], []
    turn = np.linspace(0.0, 2.0 * np.pi, _BUTTON_CORNERS, endpoint=False)
    corner = np.arange(_BUTTON_CORNERS)
    fan = np.stack([np.full_like(corner, _BUTTON_CORNERS), corner, np.roll(corner, -1)], axis=1)
    flat = 0.5 + 0.5 * np.vstack([np.stack([np.cos(turn), np.sin(turn)], axis=1), [[0.0, 0.0]]])
    for index, z_m in enumerate(np.arange(height_m.max() - 0.025, height_m.min() + 0.01, -_BUTTON_STEP_M)):
        near = int(np.argmin(np.hypot(strip_template_m[:, 1], height_m - z_m)))
        out = normal[near]
        right = np.cross([0.0, 0.0, 1.0], out)
        right /= np.linalg.norm(right)
        up = np.cross(out, right)
        ring = _BUTTON_RADIUS_M * (np.cos(turn)[:, None] * right + np.sin(turn)[:, None] * up) + 0.0012 * out
        vertices.append(strip.vertices_m[near] + np.vstack([ring, 0.0026 * out]))
        weights.append(np.repeat(strip.weights[near][None], _BUTTON_CORNERS + 1, axis=0))
        faces.append(fan + index * (_BUTTON_CORNERS + 1))
        uv.append(flat[fan])
    part = ActorPart("buttons", np.concatenate(faces).astype(np.int32), np.concatenate(uv).astype(np.float32), shade)
    return Piece(np.concatenate(vertices), np.concatenate(weights), (part,))


def joined(pieces: tuple[Piece, ...]) -> Piece:
    """One piece of several."""
    offsets = np.cumsum([0] + [len(piece.vertices_m) for piece in pieces[:-1]])
    parts = tuple(
        ActorPart(part.name, (part.faces + offset).astype(np.int32), part.uv, part.material)
        for piece, offset in zip(pieces, offsets, strict=True)
        for part in piece.parts
    )
    return Piece(
        np.concatenate([piece.vertices_m for piece in pieces]),
        np.concatenate([piece.weights for piece in pieces]),
        parts,
    )


def chest_pocket_m(template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """Metres inside a pocket on the left of the chest, on the base mesh."""
    inside = np.minimum(0.045 - np.abs(template_m[:, 1] - 0.075), 0.05 - np.abs(template_m[:, 2] - 0.335))
    return np.where(template_m[:, 0] > 0.05, inside, -1.0)


def back_pockets_m(template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """Metres inside the two pockets on the seat of trousers, on the base mesh; they narrow downward."""
    drop_m = 0.075 - template_m[:, 2]
    half_m = 0.052 - 0.10 * np.clip(drop_m - 0.07, 0.0, 1.0)
    inside = np.minimum(half_m - np.abs(np.abs(template_m[:, 1]) - 0.078), np.minimum(drop_m, 0.13 - drop_m))
    return np.where(template_m[:, 0] < 0.0, inside, -1.0)
