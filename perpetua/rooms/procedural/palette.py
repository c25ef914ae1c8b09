"""The materials of one room, drawn together so that they go together."""

import colorsys
from dataclasses import dataclass

import numpy as np

from perpetua.rooms.types import Material

Color = tuple[float, float, float]


@dataclass(frozen=True)
class Palette:
    """What everything in a room is made of."""

    wall: Material
    ceiling: Material
    trim: Material
    floor: Material
    wood: Material
    dark_wood: Material
    lacquer: Material
    worktop: Material
    upholstery: Material
    linen: Material
    rug: Material
    curtain: Material
    metal: Material
    black: Material
    ceramic: Material
    mirror: Material
    leaf: Material
    soil: Material
    lamp_shade: Material
    accents: tuple[Material, ...]
    pictures: tuple[Material, ...]


# Linear RGB of light and dark grain.
WOODS: tuple[tuple[Color, Color], ...] = (
    ((0.50, 0.30, 0.14), (0.36, 0.20, 0.085)),
    ((0.62, 0.44, 0.26), (0.50, 0.33, 0.18)),
    ((0.29, 0.14, 0.065), (0.19, 0.085, 0.04)),
    ((0.40, 0.27, 0.17), (0.29, 0.185, 0.11)),
)
DARK_WOODS: tuple[tuple[Color, Color], ...] = (
    ((0.12, 0.060, 0.032), (0.07, 0.035, 0.02)),
    ((0.17, 0.085, 0.04), (0.10, 0.05, 0.025)),
    ((0.07, 0.060, 0.055), (0.04, 0.035, 0.03)),
)


def sample_palette(rng: np.random.Generator, kind: str) -> Palette:
    """Draws the materials of a room of this kind."""
    hue = float(rng.uniform())
    wood, dark_wood = (_wood(name, woods, rng) for name, woods in (("wood", WOODS), ("dark wood", DARK_WOODS)))
    plain_wall = _color(hue + rng.uniform(-0.05, 0.05), rng.uniform(0.03, 0.22), rng.uniform(0.62, 0.85))
    cloth = _color(hue + rng.choice([0.0, 0.08, 0.5]), rng.uniform(0.25, 0.7), rng.uniform(0.12, 0.5))
    second_cloth = _color(hue + rng.choice([0.1, 0.4, 0.6]), rng.uniform(0.3, 0.75), rng.uniform(0.2, 0.6))
    lacquer = _color(hue + rng.uniform(-0.1, 0.1), rng.choice([0.03, 0.1, 0.45]), rng.uniform(0.4, 0.8))
    stone = _color(rng.uniform(0.05, 0.15), 0.08, rng.choice([0.12, 0.6]))
    return Palette(
        wall=_wall(kind, plain_wall, rng),
        ceiling=Material("ceiling", (0.82, 0.82, 0.80), (0.79, 0.79, 0.77), 0.9, pattern="plaster", scale_m=0.3),
        trim=Material("trim", (0.78, 0.77, 0.74), roughness=0.4),
        floor=_floor(kind, rng),
        wood=wood,
        dark_wood=dark_wood,
        lacquer=Material("lacquer", lacquer, roughness=0.35),
        worktop=Material("worktop", stone, _shade(stone, 0.6), 0.25, pattern="marble", scale_m=0.5),
        upholstery=Material("upholstery", cloth, _shade(cloth, 0.75), 0.95, pattern="fabric", scale_m=0.012),
        linen=Material("linen", (0.72, 0.71, 0.68), (0.64, 0.63, 0.60), 0.95, pattern="fabric", scale_m=0.01),
        rug=_rug(second_cloth, rng),
        curtain=Material("curtain", _shade(second_cloth, 1.2), second_cloth, 0.95, pattern="fabric", scale_m=0.015),
        metal=Material("metal", (0.56, 0.55, 0.53), roughness=0.3, metallic=1.0),
        black=Material("black", (0.018, 0.018, 0.02), roughness=0.25),
        ceramic=Material("ceramic", (0.82, 0.82, 0.80), roughness=0.12),
        mirror=Material("mirror", (0.85, 0.86, 0.87), roughness=0.04, metallic=1.0),
        leaf=Material("leaf", (0.045, 0.16, 0.03), (0.08, 0.24, 0.05), 0.5, pattern="stripes", scale_m=0.04),
        soil=Material("soil", (0.05, 0.03, 0.02), roughness=1.0),
        lamp_shade=Material("lamp shade", (0.85, 0.78, 0.62), roughness=0.9, emission_w_m2=6.0),
        accents=tuple(_accent(f"accent {index}", hue + 0.2 * index, rng) for index in range(5)),
        pictures=tuple(_picture(f"picture {index}", rng) for index in range(4)),
    )


def _color(hue: float, saturation: float, value: float) -> Color:
    red, green, blue = colorsys.hsv_to_rgb(float(hue) % 1.0, float(saturation), float(value))
    return red, green, blue


def _shade(color: Color, factor: float) -> Color:
    red, green, blue = (min(1.0, factor * channel) for channel in color)
    return red, green, blue


def _wood(name: str, woods: tuple[tuple[Color, Color], ...], rng: np.random.Generator) -> Material:
    light, dark = woods[int(rng.integers(len(woods)))]
    return Material(name, light, dark, float(rng.uniform(0.35, 0.6)), pattern="wood", scale_m=0.12)


def _wall(kind: str, plain: Color, rng: np.random.Generator) -> Material:
    if kind == "bathroom":
        tile_m = float(rng.choice([0.15, 0.2, 0.3]))
        return Material("wall tiles", _shade(plain, 1.1), _shade(plain, 0.75), 0.2, pattern="tile", scale_m=tile_m)
    return Material("wall plaster", plain, _shade(plain, 0.94), 0.9, pattern="plaster", scale_m=0.4)


def _floor(kind: str, rng: np.random.Generator) -> Material:
    if kind == "bathroom" or (kind == "kitchen" and rng.uniform() < 0.7):
        grey = _color(rng.uniform(0.02, 0.6), rng.uniform(0.0, 0.15), rng.uniform(0.25, 0.6))
        pattern = str(rng.choice(["tile", "checks", "marble"]))
        return Material("floor tiles", grey, _shade(grey, 0.55), 0.3, pattern=pattern, scale_m=0.4)
    light, dark = WOODS[int(rng.integers(len(WOODS)))]
    return Material("floor boards", light, dark, 0.45, pattern="wood", scale_m=0.18)


def _rug(color: Color, rng: np.random.Generator) -> Material:
    pattern = str(rng.choice(["fabric", "stripes", "checks"]))
    scale_m = 0.02 if pattern == "fabric" else float(rng.uniform(0.15, 0.35))
    return Material("rug", color, _shade(color, float(rng.choice([0.55, 1.7]))), 1.0, pattern=pattern, scale_m=scale_m)


def _accent(name: str, hue: float, rng: np.random.Generator) -> Material:
    color = _color(hue + rng.uniform(-0.07, 0.07), rng.uniform(0.35, 0.85), rng.uniform(0.2, 0.7))
    return Material(name, color, roughness=float(rng.uniform(0.2, 0.8)))


def _picture(name: str, rng: np.random.Generator) -> Material:
    ground = _color(rng.uniform(), rng.uniform(0.2, 0.7), rng.uniform(0.3, 0.8))
    figure = _color(rng.uniform(), rng.uniform(0.3, 0.9), rng.uniform(0.1, 0.7))
    pattern = str(rng.choice(["marble", "checks", "stripes", "tile"]))
    return Material(name, ground, figure, 0.6, pattern=pattern, scale_m=float(rng.uniform(0.12, 0.4)))
