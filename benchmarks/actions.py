"""Contact strips of what actors can do: one row of six moments per action, pace and way of sitting.

    python benchmarks/actions.py OUT_FOLDER [--only wave "sit down"] [--actor 0]

Bodies are those of the default body model, drawn by casting rays: no renderer is needed.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from perpetua.actors.bodies.assembly import assemble_actors, draw_bodies, measured_skeletons
from perpetua.actors.bodies.source import Body
from perpetua.actors.config import ActorsConfig
from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.raycast import Caster
from perpetua.motion.actions import known_actions
from perpetua.motion.config import MotionConfig
from perpetua.motion.plan import make_motions
from perpetua.navigation.seat_measure import measure_seat
from perpetua.scene.actor import ActorMesh, Dwell, Route
from perpetua.scene.room import Material, Room, SceneObject
from perpetua.seeding import StageSeed

FPS = 24.0
MOMENTS = 6
TILE_PX = (190, 260)
# Frames of a strip before and after its main moment.
EITHER_SIDE = 32
ROWS_PER_SHEET = 7
SPEEDS_MPS = {"stand": 0.0, "stroll": 0.7, "walk": 1.2, "brisk": 1.7, "jog": 2.7}
GREY = Material("grey", (0.5, 0.5, 0.5))


def box(low_m: tuple[float, float, float], high_m: tuple[float, float, float]) -> TriMesh:
    """A block between two corners."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
    return TriMesh(np.array(low_m) + corners * (np.array(high_m) - np.array(low_m)), np.array(faces, np.int32))


def stage_room(seat_m: float | None = None) -> Room:
    """A bare floor, with a shelf to point at, and a chair at x = 0 that faces +X where ``seat_m`` is its height."""
    objects = [
        ("floor", box((-30.0, -30.0, -0.1), (30.0, 30.0, 0.0))),
        ("shelf", box((1.6, -1.6, 0.0), (2.4, -1.3, 1.9))),
    ]
    if seat_m is not None:
        chair = [box((-0.22, -0.23, 0.0), (0.24, 0.23, seat_m)), box((-0.25, -0.23, 0.0), (-0.22, 0.23, seat_m + 0.45))]
        objects[1] = ("chair", join(chair))
    built = tuple(
        SceneObject(index, f"{category}_{index}", category, mesh, GREY, category == "floor", True)
        for index, (category, mesh) in enumerate(objects, start=1)
    )
    corners_m = np.array([[-30.0, -30.0], [30.0, -30.0], [30.0, 30.0], [-30.0, 30.0]])
    return Room("stage", "livingroom", corners_m, 2.8, built, (), None)


def straight(speed_mps: float, seconds: float, words: str) -> Route:
    """A route along +X."""
    time_s = np.arange(round(seconds * FPS)) / FPS
    position_m = np.stack([speed_mps * time_s, np.zeros_like(time_s), np.zeros_like(time_s)], axis=1)
    return Route(0, position_m, np.zeros(len(time_s)), words)


def sitting_route(room: Room, seat_m: float, seconds: float) -> Route:
    """Standing half a metre in front of a chair, sitting down on it, and standing up."""
    route = straight(0.0, seconds, "sits down")
    seat = measure_seat(2, (0.0, 0.0, seat_m), 0.0, 0.0, Caster(join([obj.mesh for obj in room.objects])))
    dwell = Dwell(8, len(route.heading_rad) - 8, "sit", 2, seat.middle_m, seat)
    return replace(route, position_m=route.position_m + np.array([0.52, 0.0, 0.0]), dwells=(dwell,))


def animate(body: Body, route: Route, room: Room, seed: int) -> ActorMesh:
    """The body on the route."""
    (skeleton,) = measured_skeletons((body,))
    motions = make_motions((route,), (skeleton,), room, FPS, MotionConfig(), StageSeed(seed, 0, "motion"))
    return assemble_actors((body,), motions, 10)[0]


def picture(
    vertices_m: np.ndarray, faces: np.ndarray, scene: TriMesh, middle_m: np.ndarray, turn_rad: float
) -> np.ndarray:
    """A shaded view from the side that ``turn_rad`` says (0: from the front)."""
    width, height = TILE_PX
    away = np.array([np.cos(turn_rad), np.sin(turn_rad), 0.18])
    away /= np.linalg.norm(away)
    right = np.cross([0.0, 0.0, 1.0], away)
    right /= np.linalg.norm(right)
    up = np.cross(away, right)
    metres = 2.35 / height
    x_px, y_px = np.meshgrid(np.arange(width) - 0.5 * width, 0.5 * height - np.arange(height))
    origins_m = middle_m + 4.0 * away + metres * (x_px.reshape(-1, 1) * right + y_px.reshape(-1, 1) * up)
    image = np.full((height * width, 3), 245, np.uint8)
    depth_m = np.full(height * width, np.inf)
    for mesh, tint in ((scene, (0.8, 0.75, 0.7)), (TriMesh(vertices_m, faces), (0.55, 0.75, 1.0))):
        if len(mesh.faces) == 0:
            continue
        hits = Caster(mesh).first_hit(origins_m, np.tile(-away, (len(origins_m), 1)))
        corners_m = mesh.vertices_m[mesh.faces[np.maximum(hits.face, 0)]]
        normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        light = 0.3 + 0.7 * np.abs(normal @ (0.8 * away + 0.3 * right + 0.5 * up))
        nearer = hits.hit & (hits.distance_m < depth_m)
        image[nearer] = np.clip(230 * light[nearer, None] * np.array(tint), 0, 255)
        depth_m[nearer] = hits.distance_m[nearer]
    return image.reshape(height, width, 3)


def strip(
    name: str, mesh: ActorMesh, room: Room, frames: list[int], turn_rad: float, fixed: bool = False
) -> np.ndarray:
    """One row: the body at some frames."""
    scene = join([obj.mesh for obj in room.objects if obj.category == "chair"])
    tiles = []
    for frame in frames:
        vertices_m = mesh.vertices_m[frame].astype(np.float64)
        middle_m = np.array([*vertices_m[:, :2].mean(axis=0), 0.95]) if not fixed else np.array([0.2, 0.0, 0.95])
        tiles.append(picture(vertices_m, mesh.faces, scene, middle_m, turn_rad))
    row = np.concatenate(tiles, axis=1)
    cv2.putText(row, name, (4, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (160, 0, 0), 1, cv2.LINE_AA)
    return row


def action_strips(bodies: tuple[Body, ...], names: list[str]) -> list[np.ndarray]:
    """A row per action, by a body that stands, seen from half in front."""
    rows = []
    for index, name in enumerate(names):
        room = stage_room()
        mesh = animate(bodies[index % len(bodies)], straight(0.0, 10.0, name), room, 3 + index)
        rows.append(strip(name, mesh, room, eventful_frames(mesh), 0.55))
    return rows


def eventful_frames(mesh: ActorMesh) -> list[int]:
    """Moments around the one at which the body is farthest from how it mostly is."""
    places_m = mesh.vertices_m[:, ::37]
    away_m = np.percentile(np.linalg.norm(places_m - np.median(places_m, axis=0), axis=2), 98, axis=1)
    middle = int(np.clip(away_m.argmax(), EITHER_SIDE, len(away_m) - 1 - EITHER_SIDE))
    return np.linspace(middle - EITHER_SIDE, middle + EITHER_SIDE, MOMENTS).astype(int).tolist()


def pace_strips(bodies: tuple[Body, ...]) -> list[np.ndarray]:
    """A row per pace, from the side, over one second or so."""
    rows = []
    for index, (pace, speed_mps) in enumerate(SPEEDS_MPS.items()):
        mesh = animate(bodies[index % len(bodies)], straight(speed_mps, 4.0, "walks"), stage_room(), 50 + index)
        rows.append(strip(f"{pace} {speed_mps} m/s", mesh, stage_room(), [40 + 3 * k for k in range(MOMENTS)], -1.45))
    return rows


def seat_strips(bodies: tuple[Body, ...]) -> list[np.ndarray]:
    """Sitting down on seats of several heights, from the side."""
    rows = []
    for index, seat_m in enumerate((0.40, 0.44, 0.50, 0.55)):
        room = stage_room(seat_m)
        mesh = animate(bodies[index % len(bodies)], sitting_route(room, seat_m, 8.0), room, 70 + index)
        rows.append(strip(f"seat {seat_m} m", mesh, room, [10, 36, 50, 90, 146, 170], -1.35, fixed=True))
        rows.append(strip(f"seat {seat_m} m", mesh, room, [10, 36, 50, 90, 146, 170], -0.3, fixed=True))
    return rows


def write_sheets(folder: Path, name: str, rows: list[np.ndarray]) -> None:
    """Rows in sheets of a size that can be looked at."""
    for start in range(0, len(rows), ROWS_PER_SHEET):
        path = folder / f"{name}_{start // ROWS_PER_SHEET}.png"
        cv2.imwrite(str(path), np.concatenate(rows[start : start + ROWS_PER_SHEET])[..., ::-1])
        print(path)


def main() -> None:
    """Draws the sheets."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", help="actions; none: all, paces and sitting")
    parser.add_argument("--bodies", type=int, default=2, help="how many people take turns")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    bodies = draw_bodies(ActorsConfig(count=arguments.bodies), StageSeed(5, 0, "bodies"))
    if arguments.only is None or "paces" in arguments.only:
        write_sheets(arguments.folder, "paces", pace_strips(bodies))
    if arguments.only is None or "sitting" in arguments.only:
        write_sheets(arguments.folder, "sitting", seat_strips(bodies))
    names = [name for name in known_actions() if arguments.only is None or name in arguments.only]
    write_sheets(arguments.folder, "actions", action_strips(bodies, names))


if __name__ == "__main__":
    main()
