"""Clothes, hair and shoes painted on a body: its surface cut along their edges, and lifted by their thickness.

SMPL-X has no garments of its own. What people wear is drawn on the T-pose: a top, trousers, shoes and hair are the
parts of the body's surface inside their outlines, which stand off the skin as far as cloth is thick.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int32, Int64

from perpetua.actors.base.surface import averaging, vertex_normals
from perpetua.actors.bodies.smplx_model import LEFT_EYE, RIGHT_EYE, SmplxModel
from perpetua.scene.actor import BODY_JOINTS

LABELS = ("body", "left eye", "right eye", "shoes", "trousers", "top", "hair")
_BODY, _LEFT_EYE, _RIGHT_EYE, _SHOES, _TROUSERS, _TOP, _HAIR = range(len(LABELS))
_THICKNESS_M = (0.0, 0.0, 0.0, 0.007, 0.006, 0.008, 0.012)
_SMOOTHING = 2
_BISECTIONS = 14
# Where the hair begins: fraction of the way from the head joint to the crown, by how far in front of the joint.
_HAIRLINE_X_M = (-0.08, -0.02, 0.03, 0.07, 0.11)
_HAIRLINE_FRACTION = (0.0, 0.15, 0.55, 0.78, 0.84)


@dataclass(frozen=True)
class Cut:
    """What is worn: ``sleeve`` and ``leg`` as fractions of arm and leg, heights and widths in metres."""

    sleeve: float
    leg: float
    waist_m: float = 0.07
    neck_m: float = 0.085
    neck_depth_m: float = 0.045
    shoe_m: float = 0.085


@dataclass(frozen=True)
class CutSurface:
    """A body's surface cut into parts. Vertices are places on edges of the body's own mesh.

    Vertex p lies at ``fraction[p]`` of the way from body vertex ``ends[p, 0]`` to ``ends[p, 1]``. ``labels`` are
    those of faces, indices into ``LABELS``; ``source`` is the body's face that each came from and ``corners`` the
    places of its corners in it.
    """

    ends: Int32[np.ndarray, "P 2"]
    fraction: Float32[np.ndarray, " P"]
    faces: Int32[np.ndarray, "F 3"]
    labels: Int64[np.ndarray, " F"]
    source: Int64[np.ndarray, " F"]
    corners: Float64[np.ndarray, "F 3 3"]


@dataclass(frozen=True)
class _Outlines:
    """The lines between parts on one body, in the T-pose with the soles on z = 0."""

    cut: Cut
    joint_m: Float64[np.ndarray, "55 3"]
    crown_z_m: float

    def label(self, place_m: Float64[np.ndarray, "*n 3"], head: Float64[np.ndarray, "*n"]) -> Int64[np.ndarray, "*n"]:
        """The part that each place of the surface belongs to; ``head`` is how far it follows the head."""
        pelvis, hip, ankle = self._joint("pelvis"), self._joint("left_hip"), self._joint("left_ankle")
        shoulder, wrist = self._joint("left_shoulder"), self._joint("left_wrist")
        x, side, z = place_m[..., 0], np.abs(place_m[..., 1]), place_m[..., 2]
        sleeve_y_m = shoulder[1] + self.cut.sleeve * (wrist[1] - shoulder[1])
        hem_z_m = hip[2] + self.cut.leg * (ankle[2] - hip[2])
        waist = z < pelvis[2] + self.cut.waist_m
        label = np.full(z.shape, _BODY)
        label[~waist & (side < sleeve_y_m) & (head < 0.5) & ~self._neckline(x, side, z)] = _TOP
        label[waist & (z > hem_z_m)] = _TROUSERS
        label[z < self.cut.shoe_m] = _SHOES
        label[(head >= 0.5) & self._scalp(x, z)] = _HAIR
        return label

    def _joint(self, name: str) -> Float64[np.ndarray, "3"]:
        return np.asarray(self.joint_m[BODY_JOINTS.index(name)])

    def _neckline(self, x: np.ndarray, side: np.ndarray, z: np.ndarray) -> np.ndarray:
        neck = self._joint("neck")
        return np.asarray((np.hypot(x - neck[0], side) < self.cut.neck_m) & (z > neck[2] - self.cut.neck_depth_m))

    def _scalp(self, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        head = self._joint("head")
        line = np.interp(x - head[0], _HAIRLINE_X_M, _HAIRLINE_FRACTION)
        return np.asarray(z > head[2] + line * (self.crown_z_m - head[2]))


def _head_weight(model: SmplxModel) -> Float64[np.ndarray, "10475"]:
    """Weight of head and jaw; the neck counts by half of what is shared with it."""
    columns = [BODY_JOINTS.index("head"), 22, LEFT_EYE, RIGHT_EYE]
    return model.weights[:, columns].sum(axis=1).astype(np.float64)


def _eyes(model: SmplxModel) -> Int64[np.ndarray, "20908"]:
    """For each face the label of the eye it belongs to, or 0."""
    label = np.zeros(len(model.faces), dtype=np.int64)
    for joint, eye in ((LEFT_EYE, _LEFT_EYE), (RIGHT_EYE, _RIGHT_EYE)):
        label[np.all(model.weights[:, joint][model.faces] > 0.5, axis=1)] = eye
    return label


def _edge_places(
    outlines: _Outlines, place_m: np.ndarray, head: np.ndarray, label: np.ndarray, ends: Int64[np.ndarray, "E 2"]
) -> Float64[np.ndarray, " E"]:
    """How far along each edge, from 0 to 1, the label of its first end ends, by bisection."""
    low, high = np.zeros(len(ends)), np.ones(len(ends))
    first = label[ends[:, 0]]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        place = place_m[ends[:, 0]] + middle[:, None] * (place_m[ends[:, 1]] - place_m[ends[:, 0]])
        fraction = head[ends[:, 0]] + middle * (head[ends[:, 1]] - head[ends[:, 0]])
        same = outlines.label(place, fraction) == first
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return np.asarray(np.clip(0.5 * (low + high), 0.02, 0.98))


def cut_parts(
    model: SmplxModel, vertices_m: Float64[np.ndarray, "10475 3"], joint_m: Float64[np.ndarray, "55 3"], cut: Cut
) -> tuple[CutSurface, Float64[np.ndarray, "10475 3"]]:
    """Cuts a body's surface along the outlines of what it wears.

    Args:
        model: whose faces and weights are used.
        vertices_m: the body in the T-pose, in our axes, soles on z = 0.
        joint_m: its joints.
        cut: what is worn.

    Returns:
        The surface, and the body's vertices lifted by what lies on them.
    """
    outlines, head, eye = _Outlines(cut, joint_m, float(vertices_m[:, 2].max())), _head_weight(model), _eyes(model)
    label = outlines.label(vertices_m, head)
    corner_label = label[model.faces]
    mixed = (corner_label.min(axis=1) != corner_label.max(axis=1)) & (eye == 0)
    # Where three parts meet in one face the face goes to one of them.
    alone = corner_label == np.roll(corner_label, 1, axis=1)
    two = mixed & (alone.sum(axis=1) == 1)
    whole = ~two
    whole_label = np.where(eye > 0, eye, np.median(corner_label, axis=1).astype(np.int64))[whole]
    surface = _with_cut_faces(model, vertices_m, outlines, label, head, np.flatnonzero(two), whole, whole_label)
    thickness = np.array(_THICKNESS_M)[label]
    thickness[np.unique(model.faces[eye > 0])] = 0.0
    mean = averaging(model.faces, len(vertices_m))
    for _ in range(_SMOOTHING):
        thickness = 0.5 * thickness + 0.5 * (mean @ thickness)
    thickness[np.unique(model.faces[eye > 0])] = 0.0
    return surface, vertices_m + thickness[:, None] * vertex_normals(vertices_m, model.faces)


def _with_cut_faces(
    model: SmplxModel,
    vertices_m: np.ndarray,
    outlines: _Outlines,
    label: np.ndarray,
    head: np.ndarray,
    two: Int64[np.ndarray, " M"],
    whole: np.ndarray,
    whole_label: np.ndarray,
) -> CutSurface:
    """Splits faces of two parts: the corner that is alone on its side is cut off."""
    corner_label = label[model.faces[two]]
    pairs = corner_label == np.roll(corner_label, -1, axis=1)
    # Corners k and k + 1 are alike, so k + 2 is alone.
    turn = (np.argmax(pairs, axis=1) + 2) % 3
    order = (turn[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(model.faces[two], order, axis=1).astype(np.int64).T
    edges = np.concatenate([np.stack([a, b], axis=1), np.stack([a, c], axis=1)])
    ends, place = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    fraction = _edge_places(outlines, vertices_m, head, label, ends)
    new = len(vertices_m) + place.reshape(2, -1)
    # Barycentric places of the five points of each cut face.
    corner = np.eye(3)[order]
    along = fraction[place.ravel()]
    from_a = np.where(edges[:, 0] < edges[:, 1], along, 1.0 - along).reshape(2, -1, 1)
    on_ab, on_ac = (corner[:, 0] + from_a[i] * (corner[:, i + 1] - corner[:, 0]) for i in range(2))
    tip = np.stack([a, new[0], new[1]], axis=1)
    rest = (np.stack([new[0], b, c], axis=1), np.stack([new[0], c, new[1]], axis=1))
    tip_at = np.stack([corner[:, 0], on_ab, on_ac], axis=1)
    rest_at = (np.stack([on_ab, corner[:, 1], corner[:, 2]], axis=1), np.stack([on_ab, corner[:, 2], on_ac], axis=1))
    own = np.repeat(np.arange(len(vertices_m))[:, None], 2, axis=1)
    kept = np.flatnonzero(whole)
    return CutSurface(
        np.concatenate([own, ends]).astype(np.int32),
        np.concatenate([np.zeros(len(vertices_m)), fraction]).astype(np.float32),
        np.concatenate([model.faces[whole], tip, *rest]).astype(np.int32),
        np.concatenate([whole_label, label[a], label[b], label[b]]),
        np.concatenate([kept, two, two, two]),
        np.concatenate([np.broadcast_to(np.eye(3), (len(kept), 3, 3)), tip_at, *rest_at]),
    )


def wrapped_uv(
    corner_m: Float64[np.ndarray, "F 3 3"], joint_m: Float64[np.ndarray, "55 3"], tile_m: float
) -> Float32[np.ndarray, "F 3 2"]:
    """Texture coordinates that wrap a fabric around trunk, arms and legs; the fabric repeats every ``tile_m``."""
    centre = corner_m.mean(axis=1)
    shoulder, hip = joint_m[BODY_JOINTS.index("left_shoulder")], joint_m[BODY_JOINTS.index("left_hip")]
    arm = np.abs(centre[:, 1]) > shoulder[1]
    leg = ~arm & (centre[:, 2] < hip[2] - 0.03)
    axis_y_m = np.where(leg, np.sign(centre[:, 1]) * hip[1], 0.0)[:, None]
    across = np.where(arm[:, None], corner_m[..., 2] - shoulder[2], corner_m[..., 1] - axis_y_m)
    along = np.where(arm[:, None], corner_m[..., 1], corner_m[..., 2])
    angle = np.arctan2(across, corner_m[..., 0] - np.where(arm, shoulder[0], hip[0])[:, None])
    # A face over the seam keeps its corners together.
    angle = np.where(angle[:, :1] - angle > np.pi, angle + 2.0 * np.pi, angle)
    angle = np.where(angle - angle[:, :1] > np.pi, angle - 2.0 * np.pi, angle)
    radius_m = np.where(arm, 0.05, np.where(leg, 0.075, 0.15))[:, None]
    return np.stack([angle * radius_m / tile_m, along / tile_m], axis=2).astype(np.float32)
