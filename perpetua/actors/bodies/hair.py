"""Hair: a cap over the scalp under locks that follow the skull and fall."""

import numpy as np
from jaxtyping import Float32, Float64

from perpetua.actors.base.base_mesh import BODY_VERTEX_COUNT
from perpetua.actors.base.images import tileable_noise, to_srgb
from perpetua.actors.base.piece import Piece, Surface
from perpetua.actors.base.rig import BONE_COUNT, base_weights, joint_index
from perpetua.actors.base.surface import vertex_normals
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.bodies.hair_locks import CROWN_M, TIE_M, grow_spines, make_locks
from perpetua.actors.bodies.hair_styles import HairStyle
from perpetua.actors.bodies.scalp import scalp
from perpetua.actors.clothing.unwrap import unrolled
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material


def _bumpy(template_m: Float64[np.ndarray, "P 3"], rng: np.random.Generator) -> Float64[np.ndarray, " P"]:
    total = np.zeros(len(template_m))
    for _ in range(8):
        direction = rng.standard_normal(3)
        direction *= 2.0 * np.pi / rng.uniform(0.015, 0.04) / np.linalg.norm(direction)
        total += np.sin(template_m @ direction + rng.uniform(0.0, 2.0 * np.pi))
    return total / 4.0


def _hanging_weights(template_like_m: Float64[np.ndarray, "P 3"], chin_z_m: float) -> Float64[np.ndarray, "P J"]:
    """The head carries hair; what hangs below the chin follows neck and chest."""
    below = np.clip((chin_z_m - template_like_m[:, 2]) / 0.12, 0.0, 1.0)
    weights = np.zeros((len(template_like_m), BONE_COUNT))
    weights[:, joint_index("head")] = 1.0 - below
    weights[:, joint_index("neck")] = below * (1.0 - 0.7 * below)
    weights[:, joint_index("spine3")] = 0.7 * below * below
    return weights


def hair_image(colour: tuple[float, float, float], rng: np.random.Generator) -> np.ndarray:
    """Strands along v: fine streaks with lighter and darker ones."""
    size = 256
    strands = rng.normal(0.0, 1.0, size)
    broad = np.convolve(np.tile(rng.normal(0.0, 1.0, size), 3), np.ones(9) / 3.0, mode="same")[size : 2 * size]
    drift = 0.12 * tileable_noise(rng, size, 6, 3)
    light = np.clip(0.95 + 0.26 * strands[None, :] + 0.16 * broad[None, :] + drift, 0.35, 1.9)
    return to_srgb(np.array(colour) * light[..., None] + 0.004)


def curl_image(colour: tuple[float, float, float], rng: np.random.Generator) -> np.ndarray:
    """Tight curls: small bright rims with dark gaps."""
    curls = np.abs(tileable_noise(rng, 256, 40, 2))
    light = np.clip(0.35 + 0.9 * curls + 0.1 * tileable_noise(rng, 256, 6, 2), 0.2, 2.0)
    return to_srgb(np.array(colour) * light[..., None] + 0.003)


def _bun(cap: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A ball of hair at the back of the head."""
    back = cap.vertices_m[np.argmin(np.linalg.norm(cap.template_m - TIE_M, axis=1))]
    centre = back + np.array([-0.028, 0.0, 0.018])
    rows, columns = 11, 18
    polar, turn = np.meshgrid(
        np.linspace(0.02, np.pi - 0.02, rows), np.linspace(0.0, 2.0 * np.pi, columns), indexing="ij"
    )
    twist = 1.0 + 0.06 * np.sin(5.0 * turn + 4.0 * polar)
    ball = np.stack([np.cos(polar) * 0.8, np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn)], axis=2)
    vertices = centre - 0.042 * twist[..., None] * ball
    grid = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]))
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)]).astype(np.int32)
    flat = np.stack([turn / np.pi + 0.4 * polar, polar / np.pi], axis=2).reshape(-1, 2)
    return vertices.reshape(-1, 3), faces, flat[faces].astype(np.float32)


def _ponytail(cap: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A tail of hair that falls from the back of the head."""
    tie = cap.vertices_m[np.argmin(np.linalg.norm(cap.template_m - TIE_M, axis=1))]
    rows, columns = 12, 14
    fraction = np.linspace(0.0, 1.0, rows)
    back_m = np.interp(fraction, [0.0, 0.12, 0.3, 1.0], [0.004, -0.030, -0.042, -0.022])
    down_m = np.interp(fraction, [0.0, 0.12, 0.3, 1.0], [0.008, 0.004, -0.045, -0.24])
    radius_m = np.interp(fraction, [0.0, 0.10, 0.35, 0.75, 1.0], [0.012, 0.012, 0.026, 0.022, 0.004])
    turn = np.linspace(0.0, 2.0 * np.pi, columns)
    ripple = 1.0 + 0.10 * np.sin(5.0 * turn)[None, :] + 0.05 * np.sin(9.0 * turn + 1.0)[None, :]
    round_m = radius_m[:, None] * ripple
    x = back_m[:, None] + round_m * np.cos(turn) * 0.8
    vertices = tie + np.stack([x, round_m * np.sin(turn), np.broadcast_to(down_m[:, None], x.shape)], axis=2)
    grid = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]))
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)]).astype(np.int32)
    flat = np.stack(np.broadcast_arrays(turn[None, :] / np.pi, fraction[:, None]), axis=2).reshape(-1, 2)
    return vertices.reshape(-1, 3), faces, flat[faces].astype(np.float32)


_TIED = {"bun": _bun, "ponytail": _ponytail}


def make_hair(wearer: Wearer, style: HairStyle, colour: tuple[float, float, float], rng: np.random.Generator) -> Piece:
    """Hair of one style on this head; cropped hair is painted on the skin alone."""
    if style.cap_m == 0.0:
        return Piece(np.zeros((0, 3)), np.zeros((0, BONE_COUNT)), ())
    skin, field_m = scalp(wearer, style)
    normal = vertex_normals(skin.vertices_m, skin.faces)
    rise = np.clip(field_m / max(1.6 * style.cap_m, 0.012), 0.0, 1.0)
    rise = np.sqrt(rise * (2.0 - rise))
    height_m = 0.0015 + rise * (style.cap_m + style.bumps_m * _bumpy(skin.template_m, rng))
    cap_m = skin.vertices_m + height_m[:, None] * normal
    cap = Surface(skin.template_m, cap_m, skin.weights, skin.faces)
    cap_uv: Float32[np.ndarray, "F 3 2"] = unrolled(
        skin.template_m, skin.faces, CROWN_M, CROWN_M - np.array([0.0, 0.0, 0.2]), np.array([-1.0, 0.0, 0.0]), 0.16
    ) / np.float32(0.2)
    vertices, faces, uvs = [cap_m], [skin.faces], [cap_uv]
    if style.locks > 0:
        spine, normals = grow_spines(cap, vertex_normals(cap_m, cap.faces), wearer, style, rng)
        made = make_locks(spine, normals, style, rng)
        vertices.append(made[0])
        faces.append(made[1] + len(cap_m))
        uvs.append(made[2])
    if style.tied is not None:
        made = _TIED[style.tied](cap)
        vertices.append(made[0])
        faces.append(made[1] + len(cap_m))
        uvs.append(made[2])
    all_m = np.concatenate(vertices)
    chin_z_m = float(
        wearer.vertices_m[:BODY_VERTEX_COUNT][base_weights()[:BODY_VERTEX_COUNT, joint_index("head")] > 0.9, 2].min()
    )
    image = curl_image(colour, rng) if style.frizzy else hair_image(colour, rng)
    shade = Material("hair", colour, roughness=0.7, image=image)
    part = ActorPart("hair", np.concatenate(faces).astype(np.int32), np.concatenate(uvs).astype(np.float32), shade)
    return Piece(all_m, _hanging_weights(all_m, chin_z_m), (part,))
