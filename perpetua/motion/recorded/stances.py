"""When the feet of a clip stand on the floor."""

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import gaussian_filter1d

# Rows a second of a retargeted clip.
CLIP_HZ = 60.0
# A foot stands where one of its sole points is this low and this slow for at least so long.
_CONTACT_HEIGHT_M = 0.045
_CONTACT_SPEED_MPS = 0.4
_LEAST_STANCE_S = 0.12
_LEAST_SWING_S = 0.1


def find_stances(feet_m: Float64[np.ndarray, "L 4 3"], floor_m: float) -> Bool[np.ndarray, "L 2"]:
    """When each foot stands: heel or toe of its sole low and slow."""
    speed_mps = np.linalg.norm(np.gradient(feet_m[..., :2], axis=0), axis=2) * CLIP_HZ
    speed_mps = gaussian_filter1d(speed_mps, 0.02 * CLIP_HZ, axis=0)
    touches = (feet_m[..., 2] < floor_m + _CONTACT_HEIGHT_M) & (speed_mps < _CONTACT_SPEED_MPS)
    return clean_stances(np.stack([touches[:, :2].any(axis=1), touches[:, 2:].any(axis=1)], axis=1))


def clean_stances(standing: Bool[np.ndarray, "L 2"], shortest_s: float = _LEAST_STANCE_S) -> Bool[np.ndarray, "L 2"]:
    """Without stances and swings too short to be any, and without short gaps in which neither foot stands."""
    cleaned = standing.copy()
    for foot in (0, 1):
        _flip_short(cleaned[:, foot], False, round(_LEAST_SWING_S * CLIP_HZ))
        _flip_short(cleaned[:, foot], True, round(shortest_s * CLIP_HZ))
    neither = ~cleaned.any(axis=1)
    for start, end in runs(neither):
        if start > 0 and end < len(neither) and end - start <= round(_LEAST_STANCE_S * CLIP_HZ):
            middle = (start + end + 1) // 2
            cleaned[start:middle] |= cleaned[start - 1]
            cleaned[middle:end] |= cleaned[end]
    return cleaned


def runs(flags: Bool[np.ndarray, " L"]) -> list[tuple[int, int]]:
    """Stretches of true flags: first row, and the row after the last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


def _flip_short(flags: Bool[np.ndarray, " L"], value: bool, shortest: int) -> None:
    """Turns runs of ``value`` inside the clip that are shorter than ``shortest`` into their opposite, in place."""
    for start, end in runs(flags == value):
        if start > 0 and end < len(flags) and end - start < shortest:
            flags[start:end] = not value
