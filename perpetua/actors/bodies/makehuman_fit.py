"""MakeHuman's garments fitted to a shaped body, with their textures."""

import numpy as np
from jaxtyping import Float64, UInt8
from PIL import Image

from perpetua.actors.base.images import tileable_noise, to_srgb
from perpetua.actors.base.piece import Piece
from perpetua.actors.base.rig import base_weights
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.clothing.garments import DYES
from perpetua.actors.clothing.mhclo import Binding, read_mesh
from perpetua.actors.clothing.mhmat import Look, load_look, read_material, without_transparent
from perpetua.actors.clothing.wardrobe import (
    Garment,
    Wardrobe,
)
from perpetua.errors import AssetError
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material

_DECIMETRE_M = 0.1
# Surfaces that are clearer than this are left out: exact depth needs opaque ones.
_CLEAR = 0.5
_WHITE = 0.95
# Of everything but hair, and of hair, whose strands are no mirror.
_LEAST_ROUGHNESS = (0.35, 0.62)
_CLOTH_DYES = ("navy", "charcoal", "olive", "burgundy", "teal", "beige", "grey", "sky", "green", "red")


def fitted(binding: Binding, vertices_m: Float64[np.ndarray, "B 3"]) -> Float64[np.ndarray, "P 3"]:
    """Where a garment's vertices lie on a shaped body in MakeHuman's rest pose.

    Args:
        binding: the garment's.
        vertices_m: all vertices of the base mesh, facing +X.
    """
    # MakeHuman's axes: X to the body's left, Y up, Z forward.
    base_dm = vertices_m[:, [1, 2, 0]] / _DECIMETRE_M
    place_dm = np.einsum("pc,pcd->pd", binding.corner_weights, base_dm[binding.base_vertices])
    for axis, scale in enumerate(binding.scales):
        unit = 1.0
        if scale is not None:
            unit = abs(float(base_dm[scale.first, axis] - base_dm[scale.second, axis])) / scale.reference_dm
        place_dm[:, axis] += unit * binding.offset_dm[:, axis]
    return np.ascontiguousarray(place_dm[:, [2, 0, 1]]) * _DECIMETRE_M


def bound_weights(binding: Binding) -> Float64[np.ndarray, "P J"]:
    """Skinning weights: those of the base vertices, in the proportions of the binding."""
    corner_weights = np.maximum(binding.corner_weights, 0.0)
    corner_weights /= np.maximum(corner_weights.sum(axis=1, keepdims=True), 1e-12)
    weights = np.einsum("pc,pcj->pj", corner_weights, base_weights()[binding.base_vertices])
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def load_looks(garment: Garment, wardrobe: Wardrobe) -> Look | None:
    """The garment's material; None where it names none or the named file is missing."""
    path = garment.binding.material_path
    if path is None or not path.is_file():
        return None
    described = read_material(path, wardrobe.folder)
    return load_look(described) if described.opacity >= _CLEAR else None


def _shaded(image: UInt8[np.ndarray, "H W 3"], look: Look) -> UInt8[np.ndarray, "H W 3"]:
    if look.shade is None:
        return image
    size = (image.shape[1], image.shape[0])
    shade = np.asarray(Image.fromarray(look.shade).resize(size))
    return np.round(image * shade[..., None]).clip(0, 255).astype(np.uint8)


def cloth_image(look: Look | None, rng: np.random.Generator) -> UInt8[np.ndarray, "H W 3"]:
    """The garment's texture, or a plain woven cloth in its colour; white stands for any colour."""
    if look is not None and look.image is not None:
        return _shaded(look.image, look)
    dye = DYES[_CLOTH_DYES[int(rng.integers(len(_CLOTH_DYES)))]]
    colour = dye if look is None or min(look.colour) > _WHITE else look.colour
    grain = 1.0 + 0.10 * tileable_noise(rng, 512, 70, 2) + 0.06 * tileable_noise(rng, 512, 8, 3)
    plain = to_srgb(np.array(colour) * np.clip(grain, 0.5, 1.5)[..., None])
    return plain if look is None else _shaded(plain, look)


def sewn(garment: Garment, wearer: Wearer, look: Look | None, image: np.ndarray, hidden: np.ndarray) -> Piece:
    """A garment on the body, without what others hide and what its texture makes transparent."""
    binding = garment.binding
    mesh = read_mesh(binding.mesh_path)
    if mesh.vertex_count != len(binding.corner_weights):
        raise AssetError(
            f"'{binding.path}' must bind as many vertices as '{binding.mesh_path.name}' has, {mesh.vertex_count}, not "
            f"{len(binding.corner_weights)}: mend the file or take it out of the folder"
        )
    vertices_m, weights = fitted(binding, wearer.vertices_m), bound_weights(binding)
    seen = ~np.all(hidden[binding.base_vertices], axis=1)[mesh.faces].all(axis=1)
    faces, uv = mesh.faces[seen], mesh.uv[seen]
    if look is not None and look.there is not None:
        cut = without_transparent(faces, uv, len(vertices_m), look.there)
        faces, uv = cut.faces, cut.uv
        vertices_m, weights = (values[cut.from_old].mean(axis=1) for values in (vertices_m, weights))
    roughness = max(look.roughness, _LEAST_ROUGHNESS[garment.kind == "hair"]) if look is not None else 0.8
    shade = Material(garment.kind, (0.5, 0.5, 0.5), roughness=roughness, image=image)
    return Piece(vertices_m, weights, (ActorPart(garment.kind, faces, uv, shade),))
