"""How one person moves, drawn once per actor, so that no two are in step."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class GaitStyle:
    """Personal habits. ``phase_s`` shifts the first step; ``idle_phase`` and ``idle_period_s`` time idle motion."""

    cycle_factor: float
    phase_s: float
    first_side: int
    toe_out_rad: float
    walk_half_width_m: float
    stand_half_width_m: float
    clearance_m: float
    arm_swing_rad_per_m: float
    arm_abduction_rad: float
    elbow_rad: float
    lean_rad: float
    sway_m: float
    pelvis_list_rad: float
    pelvis_turn_rad_per_m: float
    gaze_pitch_rad: float
    idle_period_s: tuple[float, float, float]
    idle_phase: tuple[float, float, float]


def draw_gait_style(rng: np.random.Generator, hip_half_width_m: float) -> GaitStyle:
    """Habits around the mean of adults; ``hip_half_width_m`` is half the distance between the hip joints."""

    def draw(mean: float, spread: float) -> float:
        return float(mean + spread * np.clip(rng.standard_normal(), -2.0, 2.0))

    def three(low: float, high: float) -> tuple[float, float, float]:
        first, second, third = (float(value) for value in rng.uniform(low, high, 3))
        return first, second, third

    return GaitStyle(
        cycle_factor=draw(1.0, 0.03),
        phase_s=float(rng.uniform(0.0, 1.2)),
        first_side=int(rng.integers(2)),
        toe_out_rad=draw(0.12, 0.04),
        walk_half_width_m=max(0.045, draw(0.67, 0.06) * hip_half_width_m),
        stand_half_width_m=max(0.07, draw(1.15, 0.12) * hip_half_width_m),
        clearance_m=draw(0.025, 0.004),
        arm_swing_rad_per_m=draw(0.46, 0.07),
        arm_abduction_rad=draw(0.13, 0.02),
        elbow_rad=draw(0.22, 0.05),
        lean_rad=draw(0.035, 0.015),
        sway_m=draw(0.02, 0.003),
        pelvis_list_rad=draw(0.05, 0.01),
        pelvis_turn_rad_per_m=draw(0.12, 0.02),
        gaze_pitch_rad=draw(0.09, 0.04),
        idle_period_s=three(5.0, 13.0),
        idle_phase=three(0.0, 2.0 * np.pi),
    )
