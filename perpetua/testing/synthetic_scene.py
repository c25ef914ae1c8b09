"""A box room with a table and a walking ball-headed box, rendered by ray casting: ground truth without Blender."""

from functools import cache
from io import BytesIO

import numpy as np
import trimesh
from PIL import Image

from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.raycast import Caster
from perpetua.geometry.transforms import look_at
from perpetua.scene.actor import ActorMesh, ActorPart, BodyMotion
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Material, Room, SceneObject
from perpetua.scene.scene import RenderedView, Scene

GREY = Material("grey", (0.5, 0.5, 0.5))


def tri(mesh: trimesh.Trimesh) -> TriMesh:
    """A trimesh as ours."""
    return TriMesh(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32))


def box(size_m: tuple[float, float, float], centre_m: tuple[float, float, float]) -> trimesh.Trimesh:
    """An axis-aligned box."""
    mesh = trimesh.creation.box(size_m)
    mesh.apply_translation(centre_m)
    return mesh


def make_room() -> Room:
    """Floor, walls and ceiling as one inward shell; a table of a thin top on a leg; a turned crate."""
    shell = box((6.0, 5.0, 2.8), (0.0, 0.0, 1.4))
    shell.invert()
    crate = box((0.8, 0.6, 0.7), (0.0, 0.0, 0.0))
    crate.apply_transform(trimesh.transformations.rotation_matrix(0.6, [0, 0, 1]))
    crate.apply_translation((-1.6, 1.3, 0.35))
    table = trimesh.util.concatenate(
        [box((1.2, 0.8, 0.03), (1.6, -1.2, 0.75)), box((0.1, 0.1, 0.735), (1.6, -1.2, 0.3675))]
    )
    vase = trimesh.creation.icosphere(subdivisions=3, radius=0.15)
    vase.apply_translation((1.6, -1.2, 0.915))
    meshes = {"shell": shell, "crate": crate, "table": table, "vase": vase}
    objects = tuple(
        SceneObject(index, f"{name}_01", name, tri(mesh), GREY, name == "shell", True)
        for index, (name, mesh) in enumerate(meshes.items(), start=1)
    )
    polygon = np.array([[-3.0, -2.5], [3.0, -2.5], [3.0, 2.5], [-3.0, 2.5]])
    return Room("room", "livingroom", polygon, 2.8, objects, (), None)


def make_actor(frames: int, actor: int, object_index: int) -> ActorMesh:
    """A body of a capsule with a shirt 8 mm over it, walking and swaying."""
    body = trimesh.creation.capsule(height=1.1, radius=0.2)
    body.apply_translation((0.0, 0.0, 0.25))
    shirt_faces = np.asarray(body.faces)[(body.triangles_center[:, 2] > 0.5) & (body.triangles_center[:, 2] < 1.1)]
    shirt = trimesh.Trimesh(body.vertices + 0.008 * body.vertex_normals, shirt_faces, process=False)
    rest = np.concatenate([body.vertices, shirt.vertices])
    faces = [np.asarray(body.faces, np.int32), np.asarray(shirt_faces + len(body.vertices), np.int32)]
    parts = tuple(
        ActorPart(name, part, np.zeros((len(part), 3, 2), np.float32), GREY)
        for name, part in zip(("body", "shirt"), faces, strict=True)
    )
    vertices = np.empty((frames, len(rest), 3), np.float32)
    for frame in range(frames):
        turn, centre = walk(frame, actor)
        lean = np.array([0.05, 0.0, 0.0]) * np.sin(walk_angle(frame, actor)) * rest[:, 2:]
        vertices[frame] = (rest + lean) @ turn.T + centre
    return ActorMesh(actor, object_index, "a capsule in a shirt", parts, vertices)


def walk_angle(frame: int, actor: int) -> float:
    """How far round an actor has walked."""
    return 0.25 * frame + 2.0 * actor


def walk(frame: int, actor: int) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and place of an actor."""
    angle = walk_angle(frame, actor)
    turn = trimesh.transformations.rotation_matrix(angle, [0, 0, 1])[:3, :3]
    return turn, np.array([1.1 * np.cos(angle), 0.9 * np.sin(angle), 0.0])


def make_motion(frames: int, actor: int) -> BodyMotion:
    """The motion of ``make_actor``: a pelvis 0.8 m over where it walks, all joints turned alike."""
    turns, centres = zip(*(walk(frame, actor) for frame in range(frames)), strict=True)
    return BodyMotion(
        actor,
        24.0,
        np.repeat(np.stack(turns)[:, None], 22, axis=1),
        np.stack(centres) + np.array([0.0, 0.0, 0.8]),
        np.zeros((frames, 4), bool),
    )


def make_cameras(frames: int, count: int, width_px: int, height_px: int) -> tuple[CameraPath, ...]:
    """Cameras in the corners that drift and look at the middle."""
    corners = np.array([[2.4, 2.0, 1.7], [-2.4, 2.0, 1.4], [-2.4, -2.0, 2.1], [2.4, -2.0, 1.1]])
    intrinsics = Intrinsics.centred(width_px, height_px, 1.2)
    time = np.linspace(0.0, 1.0, frames)[:, None]
    return tuple(
        CameraPath(
            k,
            look_at(corners[k] + time * np.array([0.1, -0.25, 0.05]), time * np.array([0.2, 0.1, 0.8]) + [0, 0, 0.3]),
            intrinsics,
        )
        for k in range(count)
    )


def render(room: Room, actors: tuple[ActorMesh, ...], camera: CameraPath) -> RenderedView:
    """Depth along Z and object index at pixel centres, and a shaded JPEG."""
    size = camera.intrinsics
    rows, columns = np.mgrid[: size.height_px, : size.width_px].reshape(2, -1)
    ray = np.stack([(columns - size.cx_px) / size.fx_px, (rows - size.cy_px) / size.fy_px, np.ones(rows.size)], axis=1)
    meshes = [obj.mesh for obj in room.objects]
    owner = np.repeat(
        [obj.object_index for obj in room.objects] + [actor.object_index for actor in actors],
        [len(mesh.faces) for mesh in meshes] + [len(actor.faces) for actor in actors],
    )
    jpegs, depths, indices = [], [], []
    for frame, pose in enumerate(camera.world_from_camera):
        people = [TriMesh(actor.vertices_m[frame].astype(np.float64), actor.faces) for actor in actors]
        joined = join([*meshes, *people])
        direction = ray @ pose[:3, :3].T
        hits = Caster(joined).first_hit(np.repeat(pose[None, :3, 3], len(ray), axis=0), direction)
        depth = np.where(hits.hit, hits.distance_m / np.linalg.norm(ray, axis=1), 0.0)
        index = np.where(hits.hit, owner[hits.face], 0)
        corner = joined.vertices_m[joined.faces[hits.face]]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
        shade = 0.35 + 0.6 * np.abs(normal @ np.array([0.4, 0.3, 0.86]))
        colour = np.array(
            [
                [0.2, 0.3, 0.4],
                [0.9, 0.8, 0.7],
                [0.7, 0.4, 0.2],
                [0.5, 0.3, 0.2],
                [0.3, 0.6, 0.9],
                [0.9, 0.3, 0.3],
                [0.3, 0.8, 0.4],
            ]
        )
        rgb = (255 * shade[:, None] * colour[index % len(colour)]).clip(0, 255).astype(np.uint8)
        buffer = BytesIO()
        Image.fromarray(rgb.reshape(size.height_px, size.width_px, 3)).save(buffer, "JPEG", quality=90)
        jpegs.append(buffer.getvalue())
        depths.append(depth.reshape(size.height_px, size.width_px).astype(np.float32))
        indices.append(index.reshape(size.height_px, size.width_px).astype(np.uint16))
    return RenderedView(camera.camera, tuple(jpegs), np.stack(depths), np.stack(indices))


@cache
def make_scene(frames: int = 6, cameras: int = 3, width_px: int = 96, height_px: int = 72, actors: int = 2) -> Scene:
    """The scene, rendered once per size."""
    room = make_room()
    motions = tuple(make_motion(frames, k) for k in range(actors))
    people = tuple(make_actor(frames, k, room.next_object_index + k) for k in range(actors))
    paths = make_cameras(frames, cameras, width_px, height_px)
    return Scene(room, people, paths, motions, tuple(render(room, people, path) for path in paths))
