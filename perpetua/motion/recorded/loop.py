"""Which part of a clip walks, which stands, and how a part goes on for as long as it is wanted."""

import numpy as np
from jaxtyping import Float64

from perpetua.motion.recorded.retargeted import RetargetedClip, path_joints_m
from perpetua.motion.recorded.stances import CLIP_HZ, clean_stances, runs
from perpetua.scene.actor import Skeleton

# A body walks when its path goes at least this fast for at least so long, and stands when it is slower.
_WALKING_MPS, _LEAST_WALK_S = 0.25, 1.0
_STANDING_MPS, _LEAST_STAND_S = 0.15, 0.6
# Where a loop's ends may be looked for, how long they blend, and how much velocity counts beside place, seconds.
_SEAM_SEARCH_S = 1.4
_SEAM_BLEND_S = 0.3
_VELOCITY_COUNTS_S = 0.08


def walking_part(clip: RetargetedClip) -> RetargetedClip | None:
    """The longest part in which the body goes somewhere; None if there is none."""
    return _longest(clip, np.linalg.norm(clip.velocity_mps, axis=1) > _WALKING_MPS, _LEAST_WALK_S)


def standing_part(clip: RetargetedClip) -> RetargetedClip | None:
    """The longest part in which the body stays; None if there is none."""
    return _longest(clip, clip.standing.all(axis=1) & (clip.speed_mps < _STANDING_MPS), _LEAST_STAND_S)


def _longest(clip: RetargetedClip, flags: np.ndarray, least_s: float) -> RetargetedClip | None:
    parts = [(end - start, start, end) for start, end in runs(flags)]
    if not parts or max(parts)[0] < least_s * CLIP_HZ:
        return None
    _, start, end = max(parts)
    return clip.rows(np.arange(start, end))


def stretched(clip: RetargetedClip, seconds: float, skeleton: Skeleton, start_fraction: float) -> RetargetedClip:
    """A clip of at least ``seconds``: cut out of a longer one, or a shorter one looped.

    Args:
        clip: what is cut or looped.
        seconds: wanted duration.
        skeleton: poses are compared by its joints.
        start_fraction: from 0 to 1, where in the slack, or before the loop's end, it begins.
    """
    wanted = int(np.ceil(seconds * CLIP_HZ)) + 2
    slack = len(clip) - wanted
    if slack >= 0:
        return clip.rows(np.arange(wanted) + int(start_fraction * slack))
    first, last = _seam(clip, skeleton)
    period = last - first
    turn = np.arange(wanted) + int(start_fraction * last)
    row = np.where(turn < last, turn, first + (turn - first) % period)
    # Before the seam the clip fades into the rows that lead up to where the loop begins.
    blend = min(round(_SEAM_BLEND_S * CLIP_HZ), first, period - 1)
    into = np.clip((row - (last - blend) + 1) / (blend + 1), 0.0, 1.0) if blend > 0 else np.zeros(wanted)
    ease = into**2 * (3.0 - 2.0 * into)
    looped = clip.rows(row).mixed(clip.rows(np.where(ease > 0.0, row - period, row)), ease)
    return _cleaned(looped)


def _cleaned(clip: RetargetedClip) -> RetargetedClip:
    clip.standing[:] = clean_stances(clip.standing)
    return clip


def _seam(clip: RetargetedClip, skeleton: Skeleton) -> tuple[int, int]:
    """Rows at which the body is in the same phase: the same pose about the path, moving the same way."""
    place_m = path_joints_m(clip, skeleton)
    velocity_mps = np.gradient(place_m, axis=0) * CLIP_HZ
    feature = np.concatenate([place_m, _VELOCITY_COUNTS_S * velocity_mps], axis=1).reshape(len(clip), -1)
    reach = min(round(_SEAM_SEARCH_S * CLIP_HZ), len(clip) // 3)
    first = np.arange(min(round(_SEAM_BLEND_S * CLIP_HZ), len(clip) // 6), reach + 1)
    last = np.arange(len(clip) - 1 - reach, len(clip))
    apart = _distances(feature[first], feature[last])
    different = (clip.standing[first][:, None] != clip.standing[last][None]).any(axis=2)
    best = int(np.argmin(apart + 0.5 * different))
    return int(first[best // len(last)]), int(last[best % len(last)])


def _distances(first: Float64[np.ndarray, "A K"], last: Float64[np.ndarray, "B K"]) -> Float64[np.ndarray, "A B"]:
    squares = (first**2).sum(axis=1)[:, None] + (last**2).sum(axis=1)[None] - 2.0 * first @ last.T
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def neutral_pose(clip: RetargetedClip) -> RetargetedClip:
    """One row: the mean of all rows, which for a walk is the pose between strides."""
    mean = clip.path_from_joint.mean(axis=0)
    left, _, right = np.linalg.svd(mean)
    sign = np.tile(np.eye(3), (len(mean), 1, 1))
    sign[:, 2, 2] = np.linalg.det(left @ right)
    row = clip.rows(np.array([0]))
    row.path_from_joint[0] = left @ sign @ right
    row.offset_m[0] = (0.0, 0.0, float(clip.offset_m[:, 2].max()))
    return row
