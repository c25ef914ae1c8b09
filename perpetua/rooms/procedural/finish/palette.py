"""The materials and the manner of one room, drawn together so that they go together."""

import colorsys
from dataclasses import dataclass

import numpy as np

from perpetua.rooms.procedural.finish.prints import paint_print, paint_rug
from perpetua.scene.room import Material

Color = tuple[float, float, float]
PICTURES = 6


@dataclass(frozen=True)
class Style:
    """The manner in which a room's furniture is made."""

    legs: str
    handles: str
    fronts: str


@dataclass(frozen=True)
class Palette:
    """What everything in a room is made of, and in what manner."""

    style: Style
    wall: Material
    accent_wall: Material
    ceiling: Material
    trim: Material
    floor: Material
    wood: Material
    dark_wood: Material
    lacquer: Material
    worktop: Material
    splashback: Material
    upholstery: Material
    second_upholstery: Material
    linen: Material
    blanket: Material
    rug: Material
    curtain: Material
    metal: Material
    warm_metal: Material
    black: Material
    ceramic: Material
    mirror: Material
    wicker: Material
    leaf: Material
    second_leaf: Material
    bark: Material
    soil: Material
    paper: Material
    lamp_shade: Material
    accents: tuple[Material, ...]
    books: tuple[Material, ...]
    pictures: tuple[Material, ...]

    @property
    def handle(self) -> Material:
        """What handles and taps are made of."""
        return {"bar": self.black, "knob": self.warm_metal}.get(self.style.handles, self.metal)


# Linear RGB of light and dark grain.
WOODS: tuple[tuple[Color, Color], ...] = (
    ((0.52, 0.31, 0.15), (0.33, 0.17, 0.07)),
    ((0.64, 0.46, 0.28), (0.47, 0.30, 0.16)),
    ((0.30, 0.15, 0.07), (0.17, 0.075, 0.034)),
    ((0.41, 0.28, 0.18), (0.26, 0.165, 0.095)),
    ((0.58, 0.50, 0.40), (0.44, 0.36, 0.27)),
)
DARK_WOODS: tuple[tuple[Color, Color], ...] = (
    ((0.13, 0.064, 0.034), (0.06, 0.030, 0.017)),
    ((0.18, 0.09, 0.042), (0.085, 0.042, 0.02)),
    ((0.07, 0.060, 0.055), (0.032, 0.028, 0.025)),
)
CERAMIC: Color = (0.82, 0.82, 0.80)
# Colours of cloth, paint and pottery that people live with, linear RGB.
TONES: tuple[Color, ...] = (
    (0.52, 0.22, 0.13),
    (0.56, 0.36, 0.09),
    (0.28, 0.36, 0.24),
    (0.035, 0.07, 0.16),
    (0.52, 0.30, 0.28),
    (0.05, 0.21, 0.21),
    (0.06, 0.06, 0.07),
    (0.68, 0.62, 0.50),
    (0.05, 0.14, 0.08),
    (0.36, 0.12, 0.055),
    (0.16, 0.22, 0.30),
    (0.48, 0.39, 0.28),
    (0.33, 0.45, 0.54),
    (0.17, 0.07, 0.13),
    (0.33, 0.33, 0.32),
    (0.70, 0.69, 0.66),
)


def sample_palette(rng: np.random.Generator, kind: str, lamps_on: bool) -> Palette:
    """Draws the materials and the manner of a room of this kind."""
    hue = float(rng.uniform())
    wood, dark_wood = (_wood(name, woods, rng) for name, woods in (("wood", WOODS), ("dark wood", DARK_WOODS)))
    tones = [_jittered(TONES[int(index)], rng) for index in rng.permutation(len(TONES))]
    cloth, other_cloth = tones[0], tones[1]
    lacquer = tones[2] if rng.uniform() < 0.6 else _jittered(TONES[-1], rng)
    stone = _color(rng.uniform(0.05, 0.15), 0.06, rng.choice([0.06, 0.45, 0.7]))
    wall, accent_wall = _walls(kind, hue, rng)
    return Palette(
        style=_style(rng),
        wall=wall,
        accent_wall=accent_wall,
        ceiling=Material("ceiling", (0.84, 0.84, 0.82), (0.80, 0.80, 0.78), 0.9, pattern="plaster", scale_m=0.4),
        trim=Material("trim", (0.80, 0.79, 0.76), roughness=0.35),
        floor=_floor(kind, rng),
        wood=wood,
        dark_wood=dark_wood,
        lacquer=Material("lacquer", lacquer, roughness=float(rng.uniform(0.2, 0.45))),
        worktop=_worktop(stone, rng),
        splashback=_splashback(hue, rng),
        upholstery=_cloth("upholstery", cloth, rng),
        second_upholstery=_cloth("second upholstery", other_cloth, rng),
        linen=Material("linen", (0.74, 0.73, 0.70), (0.62, 0.61, 0.58), 0.95, pattern="fabric", scale_m=0.02),
        blanket=_cloth("blanket", tones[3] if rng.uniform() < 0.5 else tones[1], rng),
        rug=_rug((cloth, tones[3], tones[4]), rng),
        curtain=_cloth("curtain", other_cloth if rng.uniform() < 0.5 else (0.66, 0.63, 0.57), rng),
        metal=Material("metal", (0.58, 0.57, 0.55), (0.46, 0.45, 0.44), 0.28, 1.0, "brushed", 0.05),
        warm_metal=Material("warm metal", (0.72, 0.50, 0.24), (0.62, 0.42, 0.2), 0.25, 1.0, "brushed", 0.05),
        black=Material("black", (0.018, 0.018, 0.02), roughness=0.22),
        ceramic=Material("ceramic", CERAMIC, roughness=0.1),
        mirror=Material("mirror", (0.80, 0.81, 0.82), roughness=0.05, metallic=1.0),
        wicker=Material("wicker", (0.42, 0.27, 0.13), (0.17, 0.095, 0.04), 0.7, pattern="wicker", scale_m=0.03),
        leaf=Material("leaf", (0.035, 0.13, 0.025), (0.07, 0.22, 0.04), 0.4, pattern="fabric", scale_m=0.15),
        second_leaf=Material("pale leaf", (0.10, 0.22, 0.07), (0.05, 0.13, 0.05), 0.45, pattern="fabric", scale_m=0.2),
        bark=Material("bark", (0.20, 0.13, 0.08), (0.10, 0.06, 0.035), 0.9, pattern="fabric", scale_m=0.05),
        soil=Material("soil", (0.05, 0.03, 0.02), (0.02, 0.013, 0.01), 1.0, pattern="terrazzo", scale_m=0.02),
        paper=Material("paper", (0.78, 0.75, 0.68), roughness=0.9),
        lamp_shade=Material("lamp shade", (0.95, 0.83, 0.64), roughness=0.9, emission_w_m2=14.0 if lamps_on else 0.0),
        accents=tuple(_accent(f"accent {index}", tone, rng) for index, tone in enumerate(tones[1:6])),
        books=tuple(_book(f"book {index}", rng) for index in range(7)),
        pictures=tuple(_picture(f"picture {index}", hue, rng) for index in range(PICTURES)),
    )


def cloth_of(material: Material) -> Material:
    """Cloth in the colour of a plain material; any other stays what it is."""
    if material.pattern != "plain" or material.image is not None:
        return material
    second = _shade(material.base_color, 0.65)
    return Material(f"{material.name} cloth", material.base_color, second, 0.95, pattern="fabric", scale_m=0.02)


def _style(rng: np.random.Generator) -> Style:
    return Style(
        legs=str(rng.choice(["turned", "tapered", "square", "metal"])),
        handles=str(rng.choice(["bar", "knob", "cup"])),
        fronts=str(rng.choice(["flat", "framed"])),
    )


def _color(hue: float, saturation: float, value: float) -> Color:
    red, green, blue = colorsys.hsv_to_rgb(float(hue) % 1.0, float(saturation), float(value))
    return red, green, blue


def _jittered(color: Color, rng: np.random.Generator) -> Color:
    """A colour a little lighter or darker, warmer or cooler."""
    red, green, blue = (
        float(value) for value in np.array(color) * rng.uniform(0.85, 1.15) * rng.uniform(0.95, 1.05, 3)
    )
    return red, green, blue


def _shade(color: Color, factor: float) -> Color:
    red, green, blue = (min(0.9, factor * channel) for channel in color)
    return red, green, blue


def _wood(name: str, woods: tuple[tuple[Color, Color], ...], rng: np.random.Generator) -> Material:
    light, dark = woods[int(rng.integers(len(woods)))]
    return Material(name, light, dark, float(rng.uniform(0.3, 0.55)), pattern="wood", scale_m=0.09)


def _cloth(name: str, color: Color, rng: np.random.Generator) -> Material:
    if rng.uniform() < 0.35:
        return Material(name, color, _shade(color, 0.6), 0.8, pattern="velvet", scale_m=0.35)
    return Material(name, color, _shade(color, 0.68), 0.95, pattern="fabric", scale_m=float(rng.uniform(0.015, 0.03)))


def _walls(kind: str, hue: float, rng: np.random.Generator) -> tuple[Material, Material]:
    """Most walls of a room, and the one that differs."""
    plain = _color(hue + rng.uniform(-0.05, 0.05), rng.uniform(0.02, 0.16), rng.uniform(0.62, 0.85))
    strong = _jittered(TONES[int(rng.integers(len(TONES)))], rng)
    if kind == "bathroom":
        pattern = str(rng.choice(["tile", "bricks"]))
        tile_m = float(rng.choice([0.1, 0.15, 0.2]) if pattern == "tile" else rng.choice([0.075, 0.1, 0.15]))
        tiles = Material("wall tiles", _shade(plain, 1.1), _shade(plain, 0.62), 0.12, pattern=pattern, scale_m=tile_m)
        color = strong if rng.uniform() < 0.6 else plain
        return tiles, Material("accent tiles", color, _shade(plain, 0.6), 0.15, pattern=pattern, scale_m=tile_m)
    plaster = Material("wall plaster", plain, _shade(plain, 0.92), 0.9, pattern="plaster", scale_m=0.5)
    manner = rng.uniform()
    if manner < 0.35:
        return plaster, plaster
    if manner < 0.7:
        return plaster, Material("accent paint", strong, _shade(strong, 0.9), 0.85, pattern="plaster", scale_m=0.5)
    paper_m = float(rng.uniform(0.14, 0.3))
    paper = Material("wallpaper", plain, _shade(plain, 0.78), 0.85, pattern="wallpaper", scale_m=paper_m)
    return plaster, paper


def _floor(kind: str, rng: np.random.Generator) -> Material:
    if kind == "bathroom" or (kind == "kitchen" and rng.uniform() < 0.6):
        grey = _color(rng.uniform(0.02, 0.6), rng.uniform(0.0, 0.14), rng.uniform(0.22, 0.6))
        pattern = str(rng.choice(["tile", "checks", "terrazzo", "marble"]))
        scale_m = {"terrazzo": 0.05, "checks": 0.6, "marble": 1.1}.get(pattern, float(rng.choice([0.3, 0.45, 0.6])))
        return Material("floor tiles", grey, _shade(grey, 0.5), 0.22, pattern=pattern, scale_m=scale_m)
    light, dark = (WOODS + DARK_WOODS[:2])[int(rng.integers(len(WOODS) + 2))]
    return Material("floor boards", light, dark, float(rng.uniform(0.28, 0.45)), pattern="planks", scale_m=0.14)


def _worktop(stone: Color, rng: np.random.Generator) -> Material:
    if rng.uniform() < 0.35:
        return Material("worktop", WOODS[0][0], WOODS[0][1], 0.4, pattern="wood", scale_m=0.06)
    if rng.uniform() < 0.5:
        return Material("worktop", stone, _shade(stone, 0.5), 0.2, pattern="terrazzo", scale_m=0.03)
    return Material("worktop", stone, _shade(stone, 0.45), 0.15, pattern="marble", scale_m=0.7)


def _splashback(hue: float, rng: np.random.Generator) -> Material:
    color = _color(hue + rng.uniform(-0.1, 0.1), rng.choice([0.03, 0.35]), rng.uniform(0.4, 0.8))
    pattern = str(rng.choice(["tile", "bricks"]))
    return Material("splashback", color, (0.55, 0.54, 0.52), 0.1, pattern=pattern, scale_m=0.1)


def _rug(tones: tuple[Color, Color, Color], rng: np.random.Generator) -> Material:
    if rng.uniform() < 0.75:
        return Material("rug", (0.5, 0.5, 0.5), roughness=1.0, scale_m=0.0, image=paint_rug(rng, np.array(tones)))
    return Material("rug", tones[0], _shade(tones[0], 0.5), 1.0, pattern="fabric", scale_m=0.05)


def _accent(name: str, tone: Color, rng: np.random.Generator) -> Material:
    return Material(name, tone, roughness=float(rng.uniform(0.15, 0.7)))


def _book(name: str, rng: np.random.Generator) -> Material:
    return Material(name, _jittered(TONES[int(rng.integers(len(TONES)))], rng), roughness=0.6)


def _picture(name: str, hue: float, rng: np.random.Generator) -> Material:
    image = paint_print(rng, hue + rng.choice([0.0, 0.1, 0.35, 0.5]))
    return Material(name, (0.5, 0.5, 0.5), roughness=0.35, scale_m=0.0, image=image)
