"""A small folder of MakeHuman assets, written as MakeHuman's own tools write them."""

from pathlib import Path

import numpy as np
from PIL import Image

from perpetua.actors.base.base_mesh import base_mesh

_HEADER = "# This is a clothes file for MakeHuman\n\n"
# Pairs of base vertices for X, Z and Y, as in MakeHuman's files; each with the axis it measures.
_SCALES = (("x_scale", 5399, 11998, 0), ("z_scale", 962, 5320, 2), ("y_scale", 791, 881, 1))


def base_dm() -> np.ndarray:
    """The unshaped base mesh in MakeHuman's axes and unit."""
    return base_mesh().vertices_m[:, [1, 2, 0]] / 0.1


def scale_lines() -> str:
    """Scales whose reference is the unshaped base mesh."""
    place = base_dm()
    return "".join(
        f"{name} {first} {second} {abs(place[first, axis] - place[second, axis]):.8f}\n"
        for name, first, second, axis in _SCALES
    )


def quads_of(group: str, low_z_m: float, high_z_m: float) -> np.ndarray:
    """Faces of a helper of the base mesh between two heights, arms left out."""
    quads = base_mesh().groups[group].faces
    place_m = base_mesh().vertices_m[quads]
    inside = (place_m[..., 2].min(axis=1) > low_z_m) & (place_m[..., 2].max(axis=1) < high_z_m)
    return quads[inside & (np.abs(place_m[..., 1]).max(axis=1) < 0.32)]


def write_garment(
    folder: Path,
    name: str,
    quads: np.ndarray,
    tags: tuple[str, ...] = (),
    offset_dm: float = 0.08,
    deletes: str = "",
    depth: int = 50,
) -> Path:
    """A garment of faces of the base mesh: ``.mhclo``, ``.obj`` and ``.mhmat``; returns the ``.mhclo``."""
    place = folder / name
    place.mkdir(parents=True, exist_ok=True)
    used, local = np.unique(quads, return_inverse=True)
    local = local.reshape(-1, 4)
    centre = base_dm()[used].mean(axis=0)
    rows = []
    for vertex in used:
        first, second = quads[np.any(quads == vertex, axis=1)][0][:2]
        outward = base_dm()[vertex] - centre
        step = offset_dm * outward / np.linalg.norm(outward)
        offsets = " ".join(f"{value:.5f}" for value in step)
        rows.append(f"{vertex:5d} {first:5d} {second:5d} 1.00000 0.00000 0.00000 {offsets}")
    tag_lines = "".join(f"tag {tag}\n" for tag in ("MakeHuman™", *tags))
    (place / f"{name}.mhclo").write_text(
        f"{_HEADER}basemesh hm08\n{tag_lines}\nname {name}\nobj_file {name}.obj\n{scale_lines()}"
        f"z_depth {depth}\nmaterial {name}.mhmat\nverts 0\n" + "\n".join(rows) + f"\n\ndelete_verts\n{deletes}\n",
        encoding="utf-8",
    )
    width = base_dm()[used]
    uv = (width - width.min(axis=0)) / np.ptp(width, axis=0).clip(1e-6)
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in base_dm()[used]]
    lines += [f"vt {u:.5f} {v:.5f}" for u, v in uv[:, :2]]
    lines += ["f " + " ".join(f"{corner + 1}/{corner + 1}" for corner in quad) for quad in local]
    (place / f"{name}.obj").write_text("\n".join(lines) + "\n")
    (place / f"{name}.mhmat").write_text(
        f"# This is a material file for MakeHuman\nname {name}\ndiffuseColor 1.0 1.0 1.0\nshininess 0.2\n"
        f"opacity 1.0\ntransparent False\ndiffuseTexture {name}_diffuse.png\nnormalmapTexture {name}_normal.png\n"
    )
    return place / f"{name}.mhclo"


def write_texture(path: Path, colour: tuple[int, int, int], clear_left: bool = False) -> None:
    """A grainy texture; ``clear_left`` makes its left half transparent, with another colour behind."""
    grain = np.random.default_rng(1).integers(-25, 25, (64, 64, 1))
    texels = (np.array(colour) + grain).clip(0, 255).astype(np.uint8)
    if clear_left:
        alpha = np.full((64, 64, 1), 255, dtype=np.uint8)
        alpha[:, :32] = 0
        texels[:, :32] = (255, 0, 255)
        texels = np.concatenate([texels, alpha], axis=2)
    Image.fromarray(texels).save(path)


def write_folder(root: Path) -> Path:
    """Suits for both sexes, shoes without a texture, hair with a transparent half, and one skin."""
    suit, trunk = quads_of("helper-tights", -0.70, 0.50), "0 - 100 3760 - 3780"
    for sex in ("female", "male"):
        write_garment(root / "clothes", f"{sex}_suit01", suit, (sex.title(), "Casual"), deletes=trunk)
    write_texture(root / "clothes" / "female_suit01" / "female_suit01_diffuse.png", (200, 40, 40))
    # A texture that was converted since the material was written.
    write_texture(root / "clothes" / "male_suit01" / "male_suit01_diffuse.jpg", (40, 40, 200))
    write_garment(root / "clothes", "shoes01", quads_of("helper-tights", -0.90, -0.68), ("Shoes",), 0.15, depth=5)
    write_garment(root / "hair", "short01", quads_of("helper-hair", 0.5, 1.0), ("Short",))
    write_texture(root / "hair" / "short01" / "short01_diffuse.png", (90, 60, 30), clear_left=True)
    for ancestry in ("african", "asian", "caucasian"):
        skin = root / "skins" / f"young_{ancestry}_female"
        skin.mkdir(parents=True)
        (skin / "skin.mhmat").write_text(
            f"name {skin.name}\ntag young\ntag {ancestry}\ntag female\ndiffuseTexture skin_diffuse.png\n"
        )
        write_texture(skin / "skin_diffuse.png", (10, 200, 10))
    return root
