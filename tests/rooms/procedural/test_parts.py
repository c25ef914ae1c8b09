"""The meshes that built-in rooms are made of."""

import numpy as np
import pytest
import trimesh

from perpetua.geometry.mesh import TriMesh
from perpetua.rooms.procedural.building import BUILDERS, build_piece
from perpetua.rooms.procedural.finish.palette import sample_palette
from perpetua.rooms.procedural.furniture.parts import bar, block, lathe, prism, tube
from perpetua.rooms.procedural.furniture.soft import blanket, curtain, cushion, pillow
from perpetua.rooms.procedural.layout.common_rules import CHAIR, SMALL_SIZES
from perpetua.rooms.procedural.layout.plan import DETAILS, Piece

# Of those whose size is not that of a box half a metre wide and deep.
SIZES: dict[str, tuple[float, float, float]] = {
    "armchair": (0.85, 0.86, 0.84),
    "bathroom_cabinet": (1.4, 0.5, 0.82),
    "bathtub": (1.75, 0.8, 0.56),
    "bed": (1.6, 2.08, 1.0),
    "bench": (1.2, 0.42, 0.46),
    "chair": CHAIR,
    "clock": (0.34, 0.04, 0.34),
    "coat_rack": (0.8, 0.14, 1.1),
    "coffee_table": (1.1, 0.6, 0.4),
    "curtain": (0.34, 0.10, 2.2),
    "curtain_rod": (1.9, 0.18, 0.04),
    "desk": (1.4, 0.62, 0.74),
    "dining_table": (2.0, 0.95, 0.75),
    "extractor": (0.6, 0.48, 0.85),
    "floor_lamp": (0.44, 0.44, 1.6),
    "fridge": (0.66, 0.70, 1.86),
    "kitchen_counter": (3.0, 0.64, 0.91),
    "kitchen_island": (1.6, 0.85, 0.91),
    "monitor": (0.58, 0.42, 0.46),
    "nightstand": (0.48, 0.42, 0.52),
    "paper_roll": (0.15, 0.13, 0.12),
    "picture": (0.6, 0.03, 0.5),
    "mirror": (0.9, 0.035, 0.85),
    "plant": (0.7, 0.7, 1.4),
    "plates": (0.4, 0.3, 0.02),
    "radiator": (1.2, 0.11, 0.68),
    "round_mirror": (0.7, 0.05, 0.7),
    "rug": (2.0, 1.3, 0.01),
    "shower": (0.95, 0.95, 2.05),
    "sofa": (2.2, 0.94, 0.84),
    "stool": (0.4, 0.4, 0.45),
    "tall_cabinet": (0.6, 0.64, 2.1),
    "toilet": (0.38, 0.68, 0.84),
    "towel": (0.6, 0.1, 0.75),
    "tv": (1.2, 0.24, 0.78),
    "umbrella_stand": (0.3, 0.3, 0.9),
    "wall_cabinet": (1.2, 0.35, 0.72),
    "wall_shelf": (1.0, 0.22, 0.5),
    "wardrobe": (1.8, 0.62, 2.1),
    **SMALL_SIZES,
}


def solid(mesh: TriMesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)


@pytest.mark.parametrize("category", sorted(BUILDERS))
@pytest.mark.parametrize("draw", range(2))
def test_piece_is_solid_and_fills_its_box(category: str, draw: int) -> None:
    size = SIZES.get(category, (0.5, 0.5, 0.9))
    rng = np.random.default_rng(draw)
    palette = sample_palette(rng, "livingroom", lamps_on=True)
    detail = tuple(rng.uniform(size=DETAILS).tolist())
    parts = build_piece(Piece(category, size, (0.0, 0.0, 0.0), 0, detail), palette)
    assert parts[0].label == ""
    assert parts[0].category is None
    assert len({part.label for part in parts}) == len(parts)
    for part in parts:
        mesh = solid(part.mesh)
        assert mesh.is_watertight, part.label
        assert mesh.is_winding_consistent, part.label
        assert mesh.volume > 0.0, part.label
        assert (mesh.area_faces > 0.0).mean() > 0.97, part.label
    vertices = np.concatenate([part.mesh.vertices_m for part in parts])
    low, high = vertices.min(0), vertices.max(0)
    assert (low[:2] >= np.array([-0.5 * size[0], 0.0]) - 0.015).all(), low
    assert (high[:2] <= np.array([0.5 * size[0], size[1]]) + 0.015).all(), high
    assert low[2] == pytest.approx(0.0, abs=0.03)
    # Taps stand out of what they belong to, tiles rise over a worktop; else the height is the piece's own.
    assert 0.75 * size[2] <= high[2] <= size[2] + (0.55 if category in ABOVE else 0.02), high


ABOVE = frozenset({"kitchen_counter", "bathroom_cabinet", "bathtub"})


def test_block_has_the_volume_of_its_corners() -> None:
    mesh = block((0.0, 1.0, 2.0), (0.5, 1.2, 3.0), 0.001)
    assert solid(mesh).volume == pytest.approx(0.1, rel=1e-3)
    assert mesh.vertices_m.min(0) == pytest.approx([0.0, 1.0, 2.0])
    assert mesh.vertices_m.max(0) == pytest.approx([0.5, 1.2, 3.0])


def test_block_edges_are_chamfered() -> None:
    """No two neighbouring faces of a bevelled block meet at a right angle."""
    mesh = solid(block((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 0.01))
    assert mesh.face_adjacency_angles.max() < np.radians(56.0)
    assert solid(block((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 0.1, 3)).face_adjacency_angles.max() < np.radians(31.0)


def test_lathe_and_bar_have_the_volume_of_a_cylinder() -> None:
    sides = 64
    area = 0.5 * sides * np.sin(2 * np.pi / sides) * 0.2**2
    upright = lathe([(0.0, 0.0), (0.2, 0.0), (0.2, 0.7), (0.0, 0.7)], (1.0, 1.0), sides)
    slanted = bar((0.0, 0.0, 0.0), (0.3, 0.6, 0.2), 0.2, sides)
    assert solid(upright).volume == pytest.approx(area * 0.7)
    assert solid(slanted).volume == pytest.approx(area * 0.7)


def test_tube_of_a_ring_has_the_volume_of_a_torus() -> None:
    angles = np.linspace(0.0, 2 * np.pi, 65)
    ring = tube([(float(np.cos(a)), float(np.sin(a)), 0.0) for a in angles], 0.1, 24)
    assert solid(ring).is_watertight
    assert solid(ring).volume == pytest.approx(2 * np.pi**2 * 0.1**2, rel=0.02)


def test_prism_over_an_l_has_its_volume() -> None:
    outline = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)])
    mesh = solid(prism(outline, -0.1, 0.1, apex=3))
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(0.2 * 4.0)


def test_cushion_fills_its_box_and_is_round() -> None:
    mesh = cushion((0.0, 0.0, 0.0), (2.0, 1.0, 0.5), 2.0, (16, 16, 16))
    assert mesh.vertices_m.min(0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert mesh.vertices_m.max(0) == pytest.approx([2.0, 1.0, 0.5])
    assert solid(mesh).is_watertight
    assert solid(mesh).volume == pytest.approx(4.0 / 3.0 * np.pi * 1.0 * 0.5 * 0.25, rel=0.03)
    assert solid(cushion((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 9.0)).volume > 0.9


def test_pillow_is_closed_and_thin_at_its_corners() -> None:
    mesh = pillow(0.5, 0.4, 0.15)
    assert solid(mesh).is_watertight
    assert solid(mesh).volume > 0.0
    assert np.ptp(mesh.vertices_m, axis=0) == pytest.approx([0.5, 0.15, 0.4], rel=0.03)
    corner = np.abs(mesh.vertices_m[:, [0, 2]]) > np.array([0.23, 0.18])
    assert np.abs(mesh.vertices_m[corner.all(axis=1)][:, 1]).max() < 0.03


def test_blanket_stays_in_its_box_and_is_wrinkled() -> None:
    mesh = blanket((-0.8, 0.6, 0.2), (0.8, 2.0, 0.5), (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8))
    assert solid(mesh).is_watertight
    assert (mesh.vertices_m.min(0) >= [-0.8 - 1e-9, 0.6 - 1e-9, 0.2 - 1e-9]).all()
    assert (mesh.vertices_m.max(0) <= [0.8 + 1e-9, 2.0 + 1e-9, 0.5 + 1e-9]).all()
    inside = (np.abs(mesh.vertices_m[:, 0]) < 0.6) & (np.abs(mesh.vertices_m[:, 1] - 1.3) < 0.5)
    top = mesh.vertices_m[inside & (mesh.vertices_m[:, 2] > 0.4), 2]
    assert 0.008 < np.ptp(top) < 0.04


def test_curtain_is_solid_as_deep_as_asked_and_folded() -> None:
    mesh = curtain(0.4, 0.1, 2.0, 4, 0.3)
    assert solid(mesh).is_watertight
    assert solid(mesh).volume > 0.0
    width, depth, height = np.ptp(mesh.vertices_m, axis=0)
    assert (width, height) == pytest.approx((0.4, 2.0), rel=0.01)
    assert 0.08 < depth <= 0.1 + 1e-9
    foot = mesh.vertices_m[mesh.vertices_m[:, 2] < 0.01]
    middle = foot[np.argsort(foot[:, 0])][:, 1] - 0.05
    assert (np.diff(np.sign(middle[np.abs(middle) > 0.01])) != 0).sum() >= 6
