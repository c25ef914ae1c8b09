"""What views show, measured by ray casting."""

import numpy as np

from perpetua.cameras.views import view_coverage
from perpetua.geometry.mesh import join
from perpetua.geometry.raycast import Caster
from tests.support.camera_scene import camera_path, camera_room, walker


def _seen(position_m: tuple[float, float, float], target_m: tuple[float, float, float]) -> float:
    caster = Caster(join([obj.mesh for obj in camera_room().objects]))
    path = camera_path(np.tile(np.array(position_m), (2, 1)), np.array(target_m))
    actors = (walker(0, np.tile([[-1.5, 0.0]], (2, 1))),)
    return float(view_coverage((path,), actors, caster).seen_fraction.mean())


def test_an_actor_in_the_image_is_seen() -> None:
    assert _seen((1.5, 0.0, 1.5), (-1.5, 0.0, 1.2)) == 1.0


def test_an_actor_behind_the_camera_is_not_seen() -> None:
    assert _seen((1.5, 0.0, 1.5), (2.5, 0.0, 1.2)) == 0.0


def test_an_actor_behind_the_table_top_is_not_seen() -> None:
    """From just under the sheet the upper body is hidden by it; from just above it is not."""
    assert _seen((0.4, 0.0, 0.7), (-1.5, 0.0, 1.2)) == 0.0
    assert _seen((0.4, 0.0, 0.85), (-1.5, 0.0, 1.2)) == 1.0


def test_angle_between_the_most_different_views() -> None:
    caster = Caster(join([obj.mesh for obj in camera_room().objects]))
    actors = (walker(0, np.array([[0.0, 1.0], [0.0, 1.0]])),)
    places = [(2.0, 1.0, 1.5), (0.0, 2.4, 1.5), (np.sqrt(0.5), 1.0 + np.sqrt(0.5), 1.5)]
    paths = tuple(camera_path(np.tile(place, (2, 1)), np.array([0.0, 1.0, 1.2])) for place in places)
    apart_deg = np.degrees(view_coverage(paths, actors, caster).apart_rad)
    np.testing.assert_allclose(apart_deg, 90.0, atol=0.5)
