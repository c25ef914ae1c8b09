"""Legs in the manner of a room."""

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import Palette, Style
from perpetua.rooms.procedural.furniture.parts import Profile, block, curve, lathe, moved, post
from perpetua.scene.room import Material

# Radius and height of a turned leg, as shares of its greatest radius and its height, from the foot up.
TURNED: Profile = [
    (0.50, 0.0), (0.62, 0.03), (0.66, 0.06), (0.42, 0.10), (0.48, 0.14), (0.75, 0.34), (0.86, 0.52), (0.62, 0.66),
    (0.50, 0.72), (0.90, 0.76), (0.94, 0.79), (0.55, 0.82), (0.60, 0.85),
]  # fmt: skip


def leg(style: Style, height_m: float, thick_m: float) -> TriMesh:
    """One leg around the vertical axis, as thick as ``thick_m`` at its top."""
    half = 0.5 * thick_m
    if style.legs == "turned" and height_m > 0.3:
        shaft = [(half * radius, height_m * z) for radius, z in curve(TURNED, 26)]
        head = block((-half, -half, 0.85 * height_m), (half, half, height_m), 0.003)
        return join([lathe([(0.0, 0.0), *shaft, (0.0, 0.85 * height_m)], sides=14), head])
    if style.legs in ("turned", "tapered"):
        return lathe([(0.0, 0.0), (0.55 * half, 0.0), (half, height_m), (0.0, height_m)], sides=14)
    if style.legs == "metal":
        return post((0.0, 0.0), min(0.013, half), 0.0, height_m, 10)
    return block((-half, -half, 0.0), (half, half, height_m), 0.004)


def legs(style: Style, width_m: float, depth_m: float, height_m: float, thick_m: float, inset_m: float) -> TriMesh:
    """Four legs under a rectangle whose back edge is y = 0; ``inset_m`` from its edges to the legs' outsides."""
    one = leg(style, height_m, thick_m)
    x, off = 0.5 * width_m - inset_m - 0.5 * thick_m, inset_m + 0.5 * thick_m
    return join([moved(one, (side * x, y, 0.0)) for side in (-1.0, 1.0) for y in (off, depth_m - off)])


def leg_material(palette: Palette, wood: Material) -> Material:
    """What legs are made of."""
    return palette.black if palette.style.legs == "metal" else wood
