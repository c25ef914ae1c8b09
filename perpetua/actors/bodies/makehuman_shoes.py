"""MakeHuman's shoes made to stand: level, with stiff soles, and where they meet the floor."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from perpetua.actors.base.piece import Piece
from perpetua.actors.base.rig import joint_index
from perpetua.actors.clothing.shoes import Footing

# The part of a shoe by whose length heel and ball are placed: heels of shoes may stand higher than soles.
_FOOT_M = 0.06
# How far along a shoe its heel and ball reach, and over which height the levelling of soles fades.
_NEAR_M, _STIFF_M, _FADE_M = 0.025, 0.04, 0.10
_LEVEL_PASSES = 4
_HEEL_FRACTION, _TOE_FRACTION = 0.04, 0.84
# How far shoes and socks go on under the hems of trousers.
_HEM_M = 0.03


def with_stiff_soles(shoes: Piece) -> Piece:
    """Shoes whose low part follows ankles and toes alone, so that the soles stay flat whatever the shins do."""
    low = shoes.vertices_m[:, 2] < float(shoes.vertices_m[:, 2].min()) + _FOOT_M
    weights = shoes.weights.copy()
    for side, here in (("left", shoes.vertices_m[:, 1] > 0.0), ("right", shoes.vertices_m[:, 1] <= 0.0)):
        ankle, ball = joint_index(f"{side}_ankle"), joint_index(f"{side}_foot")
        toes = weights[low & here, ball]
        weights[low & here] = 0.0
        weights[low & here, ball], weights[low & here, ankle] = toes, 1.0 - toes
    return replace(shoes, weights=weights)


def _heel_and_toe_x_m(side_m: Float64[np.ndarray, "P 3"]) -> tuple[float, float]:
    """Where along one shoe its heel and its ball stand."""
    low = side_m[side_m[:, 2] < float(side_m[:, 2].min()) + _FOOT_M]
    start, length = float(low[:, 0].min()), float(np.ptp(low[:, 0]))
    return start + _HEEL_FRACTION * length, start + _TOE_FRACTION * length


def levelled(shoes: Piece) -> Piece:
    """Shoes whose heels and balls reach the floor: MakeHuman's feet point a little down, and raise the heels."""
    vertices_m = shoes.vertices_m.copy()
    for here in (vertices_m[:, 1] > 0.0, vertices_m[:, 1] <= 0.0):
        for _ in range(_LEVEL_PASSES):
            side = vertices_m[here]
            places = _heel_and_toe_x_m(side)
            floor_m = float(side[:, 2].min())
            raised = [float(side[np.abs(side[:, 0] - x) < _NEAR_M, 2].min()) - floor_m for x in places]
            slope = (raised[1] - raised[0]) / (places[1] - places[0])
            above = np.clip(1.0 - (side[:, 2] - floor_m - _STIFF_M) / _FADE_M, 0.0, 1.0)
            vertices_m[here, 2] -= above * (raised[0] + slope * (side[:, 0] - places[0]))
        vertices_m[here, 2] -= float(vertices_m[here, 2].min()) - float(shoes.vertices_m[here, 2].min())
    return replace(shoes, vertices_m=vertices_m)


def footing_of(shoes: Piece) -> Footing:
    """Heels and balls of a pair of shoes, in the middle of the soles."""
    floor_m = float(shoes.vertices_m[:, 2].min())
    heels: list[np.ndarray] = []
    toes: list[np.ndarray] = []
    for here in (shoes.vertices_m[:, 1] > 0.0, shoes.vertices_m[:, 1] <= 0.0):
        side = shoes.vertices_m[here]
        for found, x in zip((heels, toes), _heel_and_toe_x_m(side), strict=True):
            near = side[(np.abs(side[:, 0] - x) < _NEAR_M) & (side[:, 2] < floor_m + _STIFF_M)]
            found.append(np.array([x, near[:, 1].mean(), floor_m]))
    return Footing(np.stack(heels), np.stack(toes), floor_m)


def under_hems(shoes: Piece, over: tuple[Piece, ...]) -> Piece:
    """Shoes without what of them, socks mostly, is high up in trousers: tight ones would let it through."""
    hem_z_m = min((float(piece.vertices_m[:, 2].min()) for piece in over), default=np.inf)
    part = shoes.parts[0]
    shown = shoes.vertices_m[part.faces][..., 2].min(axis=1) < hem_z_m + _HEM_M
    return replace(shoes, parts=(replace(part, faces=part.faces[shown], uv=part.uv[shown]),))
