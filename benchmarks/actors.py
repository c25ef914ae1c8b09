"""What it costs to draw, dress and pose the people of a room.

python benchmarks/actors.py --actors 4 --frames 240
"""

import argparse
import resource
import time

import numpy as np

from perpetua.actors.bodies.assembly import assemble_actors, draw_bodies
from perpetua.actors.config import ActorsConfig
from perpetua.scene.actor import BodyMotion
from perpetua.seeding import StageSeed


def main() -> None:
    """Prints seconds and peak memory."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--actors", type=int, default=4)
    parser.add_argument("--frames", type=int, default=240)
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    config = ActorsConfig(count=given.actors)
    started = time.process_time()
    bodies = draw_bodies(config, StageSeed(given.seed, 0, "bodies"))
    drawn = time.process_time()
    still = np.tile(np.eye(3), (given.frames, 22, 1, 1))
    motions = tuple(
        BodyMotion(
            actor,
            24.0,
            still,
            np.tile(body.skeleton.joint_m[0], (given.frames, 1)),
            np.zeros((given.frames, 4), dtype=bool),
        )
        for actor, body in enumerate(bodies)
    )
    actors = assemble_actors(bodies, motions, 1)
    posed = time.process_time()
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(f"{'drawn and dressed':<20}{drawn - started:8.1f} CPU s")
    print(f"{'posed':<20}{posed - drawn:8.1f} CPU s")
    print(f"{'peak memory':<20}{peak_mb:8.0f} MB")
    for actor in actors:
        print(f"{actor.vertices_m.shape[1]:>8} vertices {len(actor.faces):>8} triangles: {actor.description}")


if __name__ == "__main__":
    main()
