"""The light of a room: sky and sun through its windows, and its lamps."""

import numpy as np

from perpetua.rooms.config import Daytime
from perpetua.rooms.procedural.layout.plan import QUARTER_TURNS, WALL_THICKNESS_M, FloorPlan, Opening, Piece
from perpetua.scene.room import AreaLight, Sky

Color = tuple[float, float, float]

# Exitance of the light that comes in through a window, W/m2.
WINDOW_W_M2: dict[str, tuple[float, float]] = {"day": (40.0, 80.0), "evening": (5.0, 10.0), "night": (0.1, 0.3)}
WINDOW_COLOR: dict[str, Color] = {"day": (0.92, 0.97, 1.0), "evening": (1.0, 0.66, 0.45), "night": (0.5, 0.65, 1.0)}
# Irradiance of the sun on a surface across its rays, W/m2, and how far away its disc hangs.
SUN_W_M2: dict[str, tuple[float, float]] = {"day": (25.0, 60.0), "evening": (6.0, 14.0)}
SUN_FRACTION = 0.65
SUN_DISTANCE_M = 14.0
SUN_SIZE_M = 0.5
# Power of all ceiling lamps per square metre of floor, and of one standing lamp.
CEILING_W_M2 = (1.6, 2.6)
STANDING_W = 7.0
CEILING_LAMP_SIZE_M = 0.4


def sample_sky(rng: np.random.Generator, daytime: Daytime) -> Sky:
    """What lies outside the windows."""
    if daytime == "night":
        return Sky((0.10, 0.14, 0.30), (0.35, 0.32, 0.35), (0.02, 0.02, 0.025), float(rng.uniform(0.01, 0.03)))
    if daytime == "evening":
        glow = float(rng.uniform(0.35, 0.6))
        return Sky((0.16, 0.24, 0.48), (1.0, glow, 0.25), (0.10, 0.08, 0.07), float(rng.uniform(0.4, 0.8)))
    haze = float(rng.uniform(0.3, 1.0))
    zenith = (0.25 + 0.3 * haze, 0.48 + 0.22 * haze, 0.95)
    return Sky(zenith, (0.92, 0.96, 1.0), (0.22, 0.25, 0.15), float(rng.uniform(2.0, 3.2)))


def window_lights(
    rng: np.random.Generator, floor: FloorPlan, windows: tuple[Opening, ...], daytime: Daytime
) -> list[AreaLight]:
    """The sky's light through each window, and sometimes the sun through one of them."""
    exitance = float(rng.uniform(*WINDOW_W_M2[daytime]))
    lights = [_skylight(floor, window, exitance, WINDOW_COLOR[daytime]) for window in windows]
    if daytime in SUN_W_M2 and rng.uniform() < SUN_FRACTION:
        lights.append(_sun(rng, floor, windows[int(rng.integers(len(windows)))], daytime))
    return lights


def _outward(floor: FloorPlan, window: Opening) -> np.ndarray:
    cosine, sine = QUARTER_TURNS[floor.walls[window.wall].quarters]
    return np.array([sine, -cosine])


def _skylight(floor: FloorPlan, window: Opening, exitance: float, color: Color) -> AreaLight:
    x, y = floor.walls[window.wall].at(window.middle_m, -WALL_THICKNESS_M - 0.3)
    out = _outward(floor, window)
    tall = window.head_m - window.sill_m
    return AreaLight(
        position_m=(x, y, window.sill_m + 0.65 * tall),
        direction=(float(-0.93 * out[0]), float(-0.93 * out[1]), -0.37),
        size_m=(1.1 * window.width_m, tall),
        power_w=exitance * window.width_m * tall,
        color=color,
    )


def _sun(rng: np.random.Generator, floor: FloorPlan, window: Opening, daytime: Daytime) -> AreaLight:
    """A small far lamp that shines through the middle of a window."""
    aside, low = float(rng.uniform(-0.8, 0.8)), daytime == "evening"
    up = float(rng.uniform(0.15, 0.35) if low else rng.uniform(0.5, 0.85))
    out = _outward(floor, window)
    side = np.array([-out[1], out[0]])
    flat = np.cos(aside) * out + np.sin(aside) * side
    towards = np.array([*(np.cos(up) * flat), np.sin(up)])
    middle = np.array([*floor.walls[window.wall].at(window.middle_m, 0.0), 0.5 * (window.sill_m + window.head_m)])
    position = middle + SUN_DISTANCE_M * towards
    # A Lambertian lamp of power P gives P / (pi d^2) along its axis.
    power = float(rng.uniform(*SUN_W_M2[daytime])) * np.pi * SUN_DISTANCE_M**2
    color = (1.0, 0.55, 0.28) if low else (1.0, float(rng.uniform(0.86, 0.94)), float(rng.uniform(0.70, 0.82)))
    x, y, z = (float(value) for value in position)
    dx, dy, dz = (float(-value) for value in towards)
    return AreaLight((x, y, z), (dx, dy, dz), (SUN_SIZE_M, SUN_SIZE_M), float(power), color)


def lamp_lights(rng: np.random.Generator, floor: FloorPlan, pieces: tuple[Piece, ...]) -> list[AreaLight]:
    """The light of the lamps that are on: down from the ceiling, up and down from standing lamps."""
    color = (1.0, float(rng.uniform(0.80, 0.92)), float(rng.uniform(0.58, 0.8)))
    ceiling = [piece for piece in pieces if piece.category in ("ceiling_lamp", "pendant")]
    each_w = float(rng.uniform(*CEILING_W_M2)) * floor.area_m2 / max(1, len(ceiling))
    lights = []
    for piece in ceiling:
        size = min(CEILING_LAMP_SIZE_M, 0.8 * piece.size_m[0])
        lights.append(_lamp(piece, piece.position_m[2] - 0.02, -1.0, size, each_w, color))
    for piece in pieces:
        if piece.category in ("floor_lamp", "table_lamp"):
            top = piece.position_m[2] + piece.size_m[2]
            shade = 0.27 if piece.category == "floor_lamp" else 0.45 * piece.size_m[2]
            fraction = 1.0 if piece.category == "floor_lamp" else 0.5
            size = 0.5 * piece.size_m[0]
            lights.append(_lamp(piece, top - 0.02, 1.0, size, 0.5 * fraction * STANDING_W, color))
            lights.append(_lamp(piece, top - shade + 0.02, -1.0, size, 0.5 * fraction * STANDING_W, color))
    return lights


def _lamp(piece: Piece, z_m: float, up: float, size_m: float, power_w: float, color: Color) -> AreaLight:
    x, y = piece.to_world(0.0, 0.5 * piece.size_m[1])
    return AreaLight((x, y, z_m), (0.0, 0.0, up), (size_m, size_m), power_w, color)
