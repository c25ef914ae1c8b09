"""How cameras deviate from ideal ones: by the settings, from the seed, each view by itself."""

import numpy as np
import pytest
from pydantic import ValidationError

from perpetua.rendering.config import RenderConfig
from perpetua.rendering.sensor import SensorConfig, noise_seed, view_gains
from perpetua.seeding import StageSeed

SEED = StageSeed(7, 3, "render")
VIEWS = range(400)


def _gains(config: SensorConfig, frames: int = 8) -> np.ndarray:
    """f64[V, T, 3]"""
    gains = [view_gains(config, camera, frames, SEED) for camera in VIEWS]
    assert all(gain is not None for gain in gains)
    return np.array(gains)


def test_ideal_cameras_have_no_gains() -> None:
    assert view_gains(SensorConfig(shot_noise=0.1), 0, 5, SEED) is None


def test_exposure_differs_between_views_by_the_spread_and_is_constant() -> None:
    stops = np.log2(_gains(SensorConfig(exposure_spread_ev=0.3)))
    np.testing.assert_allclose(stops - stops[:, :1, :1], 0.0, atol=1e-12)
    assert 0.27 < stops[:, 0, 0].std() < 0.33


def test_drift_changes_slowly_with_the_deviation_that_is_set() -> None:
    stops = np.log2(_gains(SensorConfig(exposure_drift_ev=0.5), 240))[..., 0]
    assert 0.4 < np.sqrt((stops**2).mean()) < 0.6
    assert np.abs(np.diff(stops, axis=1)).max() < 0.08


def test_balance_shifts_red_and_blue_and_leaves_green() -> None:
    gains = _gains(SensorConfig(balance_spread=0.05))
    np.testing.assert_array_equal(gains[..., 1], 1.0)
    for channel in (0, 2):
        assert 0.04 < np.log(gains[:, 0, channel]).std() < 0.06
    assert abs(np.corrcoef(gains[:, 0, 0], gains[:, 0, 2])[0, 1]) < 0.2


def test_one_seed_gives_one_result_and_another_gives_another() -> None:
    config = SensorConfig(exposure_spread_ev=0.3, exposure_drift_ev=0.1, balance_spread=0.05)
    first = view_gains(config, 1, 5, SEED)
    again = view_gains(config, 1, 5, StageSeed(7, 3, "render"))
    other = view_gains(config, 1, 5, StageSeed(8, 3, "render"))
    assert first is not None
    assert again is not None
    assert other is not None
    np.testing.assert_array_equal(again, first)
    assert np.abs(other - first).min() > 1e-6
    assert noise_seed(SEED) == noise_seed(StageSeed(7, 3, "render")) != noise_seed(StageSeed(7, 4, "render"))


def test_blur_is_refused_where_bodies_would_stay_sharp() -> None:
    with pytest.raises(ValidationError, match="motion_blur needs engine cycles"):
        RenderConfig(engine="eevee", motion_blur=True)
