"""Bodies that slide, sink, float, stray, or go into furniture or each other are found and named."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh
from jaxtyping import Float32
from motion_samples import sample_route, sample_skeleton
from synthetic_scene import GREY, box, tri

from perpetua.actors.config import MotionConfig, ValidationConfig
from perpetua.actors.motion.kinematics import CONTACT_JOINTS, joint_index, joint_positions
from perpetua.actors.motion.procedural import ProceduralMotion
from perpetua.actors.types import BODY_PARENTS, ActorMesh, ActorPart, BodyMotion, Route, Skeleton
from perpetua.actors.validation import ActorReport, validate_actors
from perpetua.errors import ActorError
from perpetua.rooms.types import Room, SceneObject
from perpetua.seeding import StageSeed

FPS = 24.0
SKELETON = sample_skeleton()
CONFIG = ValidationConfig(frames=20)


def _tube_body(skeleton: Skeleton, motion: BodyMotion) -> Float32[np.ndarray, "T P 3"]:
    """Rings of 5 cm around every bone, moved with the bone's upper joint, and the four points of the soles."""
    joint_m = joint_positions(motion, skeleton)
    parts = []
    for joint, parent in enumerate(BODY_PARENTS):
        if parent < 0:
            continue
        ends_m = skeleton.joint_m[[parent, joint]]
        ring = trimesh.creation.cylinder(0.05, segment=ends_m, sections=12).subdivide().vertices
        # Tubes stay above the sole.
        ring[:, 2] = np.maximum(ring[:, 2], 0.001)
        offset_m = ring - skeleton.joint_m[parent]
        parts.append(joint_m[:, parent, None] + offset_m @ np.swapaxes(motion.world_from_joint[:, parent], 1, 2))
    for contact, name in enumerate(CONTACT_JOINTS):
        joint = joint_index(name)
        offset_m = (skeleton.contact_m[contact] - skeleton.joint_m[joint])[None]
        parts.append(joint_m[:, joint, None] + offset_m @ np.swapaxes(motion.world_from_joint[:, joint], 1, 2))
    return np.concatenate(parts, axis=1).astype(np.float32)


def _room(*furniture: tuple[str, trimesh.Trimesh]) -> Room:
    floor = box((12.0, 12.0, 0.1), (0.0, 0.0, -0.05))
    things = [("floor_01", floor), *furniture]
    objects = tuple(
        SceneObject(index, name, name[:-3], tri(mesh), GREY, name == "floor_01", True)
        for index, (name, mesh) in enumerate(things, start=1)
    )
    polygon = np.array([[-6.0, -6.0], [6.0, -6.0], [6.0, 6.0], [-6.0, 6.0]])
    return Room("room", "livingroom", polygon, 2.8, objects, (), None)


@cache
def _walker(actor: int, y_m: float = 0.0) -> tuple[ActorMesh, BodyMotion, Route]:
    route = sample_route("straight", FPS, 5.0, actor)
    route = Route(actor, route.position_m + np.array([0.0, y_m, 0.0]), route.heading_rad)
    motion = ProceduralMotion().make(route, SKELETON, "walks", FPS, MotionConfig(), StageSeed(2, 0, "motion"))
    vertices_m = _tube_body(SKELETON, motion)
    face = ActorPart("body", np.array([[0, 1, 2]], np.int32), np.zeros((1, 3, 2), np.float32), GREY)
    return ActorMesh(actor, 10 + actor, "tubes", (face,), vertices_m), motion, route


def _validate(
    walkers: list[tuple[ActorMesh, BodyMotion, Route]], room: Room, config: ValidationConfig = CONFIG
) -> ActorReport:
    actors, motions, routes = zip(*walkers, strict=True)
    return validate_actors(actors, motions, (SKELETON,) * len(walkers), routes, room, FPS, config)


def test_good_walkers_in_an_empty_room_pass_with_small_figures() -> None:
    report = _validate([_walker(0), _walker(1, 1.5)], _room())
    for figures in report.actors:
        assert figures.slide_95th_mps < 1e-3
        assert figures.sole_penetration.value_m < 1e-3 and figures.floating.value_m < 1e-3
        assert figures.scene_depth.value_m == 0.0 and figures.path_error.value_m < 0.06
    (pair,) = report.pairs
    assert pair.actors == (0, 1) and len(pair.frames) == 20
    assert np.all((pair.distance_m > 0.5) & (pair.distance_m < 1.5))
    assert json.loads(json.dumps(report.to_json()))["pairs"][0]["least_distance_m"] == pair.distance_m.min()


def test_a_body_that_slips_is_named() -> None:
    mesh, motion, route = _walker(3)
    slip_m = np.linspace(0.0, 0.1, mesh.vertices_m.shape[0], dtype=np.float32)[:, None] * np.array([[0.0, 1.0, 0.0]])
    slipping = replace(mesh, vertices_m=(mesh.vertices_m + slip_m[:, None]).astype(np.float32))
    speed_mps = 0.1 / (len(slip_m) - 1) * FPS
    with pytest.raises(ActorError, match=rf"the soles of actor 3 slide at {speed_mps:.3f} m/s .* at most 0.01 m/s"):
        _validate([(slipping, motion, route)], _room(), ValidationConfig(max_slide_mps=0.01))


@pytest.mark.parametrize(("lift_m", "verb"), [(-0.05, "sinks 0.050 m into"), (0.07, "floats 0.070 m above")])
def test_soles_off_the_floor_are_named_with_frame_and_value(lift_m: float, verb: str) -> None:
    mesh, motion, route = _walker(1)
    lifted = mesh.vertices_m.copy()
    lifted[60:, :, 2] += np.float32(lift_m)
    with pytest.raises(
        ActorError, match=rf"actor 1 {verb} the floor with the \w+ \w+ at frame (6\d|7\d|8\d|9\d|1\d\d)"
    ):
        _validate([(replace(mesh, vertices_m=lifted), motion, route)], _room(), ValidationConfig(max_slide_mps=1.0))


def test_an_arm_through_a_thin_wall_is_found_whichever_way_the_wall_faces() -> None:
    for wall in (box((6.0, 0.002, 2.0), (2.0, -0.22, 1.2)), box((6.0, 0.4, 2.0), (2.0, -0.421, 1.2))):
        for inverted in (False, True):
            if inverted:
                wall.invert()
            with pytest.raises(ActorError, match=r"actor 0 goes 0\.(0[5-9]|1)\d* m into 'screen_01' at frame \d+"):
                _validate([_walker(0)], _room(("screen_01", wall)))


def test_a_bump_in_the_way_is_measured_to_the_centimetre() -> None:
    # The wall's face cuts the tubes of the arm and nothing else; the outermost vertex says how deep.
    mesh, motion, route = _walker(0)
    outermost_m = float(mesh.vertices_m[..., 1].min())
    wall = box((20.0, 0.5, 2.0), (0.0, outermost_m + 0.03 - 0.25, 1.2))
    config = ValidationConfig(frames=200, vertices=100_000)
    depth = _validate([(mesh, motion, route)], _room(("wall_01", wall)), config).actors[0].scene_depth
    assert depth.place == "'wall_01'" and 0.02 < depth.value_m < 0.031


def test_what_is_stepped_over_or_stood_on_is_no_obstacle() -> None:
    book = box((0.3, 0.3, 0.05), (1.0, 0.1, 0.025))
    depth = _validate([_walker(0)], _room(("book_01", book))).actors[0].scene_depth
    assert depth.value_m == 0.0


def test_actors_that_meet_are_named_with_frame_and_distance() -> None:
    first, second = _walker(0), _walker(1, 0.15)
    with pytest.raises(ActorError, match=r"actors 0 and 1 come within 0\.0\d+ m at frame \d+; at least 0.02 m"):
        _validate([first, second], _room())


def test_a_pelvis_off_its_route_is_named() -> None:
    mesh, motion, route = _walker(2)
    strayed = Route(2, route.position_m + np.array([0.0, 0.3, 0.0]), route.heading_rad)
    with pytest.raises(ActorError, match=r"actor 2 strays 0\.3\d+ m from its route at frame \d+; at most 0.15 m"):
        _validate([(mesh, motion, strayed)], _room())
