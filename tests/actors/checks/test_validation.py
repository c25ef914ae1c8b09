"""Bodies that slide, sink, float, stray, or go into furniture or each other are found and named."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh
from jaxtyping import Float64

from perpetua.actors.checks.validation import ActorReport, validate_actors
from perpetua.actors.config import ValidationConfig
from perpetua.errors import ActorError
from perpetua.motion.config import MotionConfig
from perpetua.motion.kinematics import CONTACT_JOINTS, joint_index, joint_positions
from perpetua.motion.procedural import ProceduralMotion
from perpetua.scene.actor import BODY_PARENTS, ActorMesh, ActorPart, BodyMotion, Route, Skeleton
from perpetua.scene.room import Room, SceneObject
from perpetua.seeding import StageSeed
from perpetua.testing.motion_samples import empty_room, sample_route, sample_skeleton
from perpetua.testing.synthetic_scene import GREY, box, tri

FPS = 24.0
SKELETON = sample_skeleton()
CONFIG = ValidationConfig(frames=20, max_scene_depth_m=0.05)


def _tubes(skeleton: Skeleton, motion: BodyMotion, actor: int) -> ActorMesh:
    """Tubes of 5 cm around every bone, moved with the bone's upper joint, and the four points of the soles."""
    joint_m = joint_positions(motion, skeleton)
    places: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    for joint, parent in enumerate(BODY_PARENTS):
        if parent < 0:
            continue
        tube = trimesh.creation.cylinder(0.05, segment=skeleton.joint_m[[parent, joint]], sections=12).subdivide()
        faces.append(np.asarray(tube.faces) + sum(part.shape[1] for part in places))
        # Tubes stay above the sole.
        rest_m = np.maximum(tube.vertices, [-np.inf, -np.inf, 0.001])
        places.append(_moved(joint_m, motion, parent, rest_m - skeleton.joint_m[parent]))
    for contact, name in enumerate(CONTACT_JOINTS):
        joint = joint_index(name)
        places.append(_moved(joint_m, motion, joint, (skeleton.contact_m[contact] - skeleton.joint_m[joint])[None]))
    triangles = np.concatenate(faces).astype(np.int32)
    part = ActorPart("body", triangles, np.zeros((len(triangles), 3, 2), np.float32), GREY)
    return ActorMesh(actor, 10 + actor, "tubes", (part,), np.concatenate(places, axis=1).astype(np.float32))


def _moved(
    joint_m: Float64[np.ndarray, "T 22 3"], motion: BodyMotion, joint: int, offset_m: Float64[np.ndarray, "P 3"]
) -> Float64[np.ndarray, "T P 3"]:
    return joint_m[:, joint, None] + offset_m @ np.swapaxes(motion.world_from_joint[:, joint], 1, 2)


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
    motion = ProceduralMotion().make(route, SKELETON, empty_room(), FPS, MotionConfig(), StageSeed(2, 0, "motion"))
    return _tubes(SKELETON, motion, actor), motion, route


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
    config = ValidationConfig(frames=200, vertices=100_000, max_scene_depth_m=0.05)
    depth = _validate([(mesh, motion, route)], _room(("wall_01", wall)), config).actors[0].scene_depth
    assert depth.place == "'wall_01'" and 0.02 < depth.value_m < 0.031


def test_what_is_stepped_over_or_stood_on_is_no_obstacle() -> None:
    book = box((0.3, 0.3, 0.05), (1.0, 0.1, 0.025))
    depth = _validate([_walker(0)], _room(("book_01", book))).actors[0].scene_depth
    assert depth.value_m == 0.0


def test_actors_that_go_through_each_other_are_named_with_frame_and_depth() -> None:
    with pytest.raises(ActorError, match=r"actors 0 and 1 are 0\.\d+ m in each other at frame \d+; at most 0.005 m"):
        _validate([_walker(0), _walker(1, 0.3)], _room())


def test_actors_that_nearly_touch_pass_with_a_small_distance() -> None:
    first, second = _walker(0), _walker(0, 0.0)
    span_m = float(first[0].vertices_m[..., 1].max() - first[0].vertices_m[..., 1].min())
    aside = np.array([0.0, span_m + 0.005, 0.0])
    route = Route(1, second[2].position_m + aside, second[2].heading_rad)
    motion = replace(second[1], actor=1, pelvis_m=second[1].pelvis_m + aside)
    mesh = replace(second[0], actor=1, vertices_m=(second[0].vertices_m + aside).astype(np.float32))
    (pair,) = _validate([first, (mesh, motion, route)], _room(), ValidationConfig(frames=120)).pairs
    assert 0.004 < pair.distance_m.min() < 0.2


def test_a_pelvis_off_its_route_is_named() -> None:
    mesh, motion, route = _walker(2)
    strayed = Route(2, route.position_m + np.array([0.0, 0.3, 0.0]), route.heading_rad)
    with pytest.raises(ActorError, match=r"actor 2 strays 0\.3\d+ m from its route at frame \d+; at most 0.15 m"):
        _validate([(mesh, motion, strayed)], _room())
