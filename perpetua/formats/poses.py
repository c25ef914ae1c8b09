"""Where each object of a scene is at each frame: a rigid frame of its own, and the box around it in that frame.

A person's frame is the pelvis: X forward, Y to the left, Z along the spine when standing. An object of the room never
moves; its frame stands upright in the middle of its box, turned about Z so that the box covers the least floor, by at
most 45 degrees either way.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Float32, Float64

from perpetua.geometry.transforms import invert_rigid, transform_points
from perpetua.scene.actor import ActorMesh, BodyMotion
from perpetua.scene.scene import Scene


@dataclass(frozen=True)
class ObjectPoses:
    """The objects of the room in its order, then the actors. Boxes hold the lowest and the highest corner."""

    world_from_object: Float32[np.ndarray, "T K 4 4"]
    box_m: Float32[np.ndarray, "T K 2 3"]


def object_poses(scene: Scene) -> ObjectPoses:
    """The pose and the box of every object at every frame."""
    count = len(scene.room.objects) + len(scene.actors)
    world_from_object = np.empty((scene.frames, count, 4, 4), np.float32)
    box_m = np.empty((scene.frames, count, 2, 3), np.float32)
    for place, obj in enumerate(scene.room.objects):
        pose = resting_pose(obj.mesh.vertices_m)
        world_from_object[:, place] = pose
        # In the frame as it is stored, so that the stored box holds what it should.
        box_m[:, place] = _box_m(world_from_object[0, place], obj.mesh.vertices_m)
    for place, (motion, actor) in enumerate(zip(scene.motions, scene.actors, strict=True), len(scene.room.objects)):
        world_from_object[:, place] = _pelvis_poses(motion)
        box_m[:, place] = _moving_boxes_m(world_from_object[:, place], actor)
    return ObjectPoses(world_from_object, box_m)


def resting_pose(vertices_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, "4 4"]:
    """The upright frame of an object that stands still; the world's own for an object without vertices."""
    pose = np.eye(4)
    if len(vertices_m) == 0:
        return pose
    _, (first_m, second_m), angle_deg = cv2.minAreaRect(vertices_m[:, :2].astype(np.float32))
    # A square's sides, and a single point's, say nothing of a direction.
    turn = np.deg2rad(angle_deg) if max(first_m, second_m) > 0.0 else 0.0
    turn -= 0.5 * np.pi * np.round(turn / (0.5 * np.pi))
    pose[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    own_m = vertices_m @ pose[:3, :3]
    pose[:3, 3] = pose[:3, :3] @ (0.5 * (own_m.min(axis=0) + own_m.max(axis=0)))
    return pose


def _pelvis_poses(motion: BodyMotion) -> Float64[np.ndarray, "T 4 4"]:
    poses = np.tile(np.eye(4), (len(motion.pelvis_m), 1, 1))
    poses[:, :3, :3] = motion.world_from_joint[:, 0]
    poses[:, :3, 3] = motion.pelvis_m
    return poses


def _moving_boxes_m(world_from_object: Float32[np.ndarray, "T 4 4"], actor: ActorMesh) -> Float64[np.ndarray, "T 2 3"]:
    frames = zip(world_from_object, actor.vertices_m, strict=True)
    return np.stack([_box_m(pose, vertices_m.astype(np.float64)) for pose, vertices_m in frames])


def _box_m(
    world_from_object: Float[np.ndarray, "4 4"], vertices_m: Float64[np.ndarray, "P 3"]
) -> Float64[np.ndarray, "2 3"]:
    if len(vertices_m) == 0:
        return np.zeros((2, 3))
    own_m = transform_points(invert_rigid(world_from_object.astype(np.float64)), vertices_m)
    return np.stack([own_m.min(axis=0), own_m.max(axis=0)])
