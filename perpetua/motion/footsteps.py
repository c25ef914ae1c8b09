"""Which foot stands where and when."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from perpetua.motion.ground import Ground
from perpetua.motion.path import MARGIN_S, RoutePath
from perpetua.motion.style import GaitStyle

LEFT, RIGHT = 0, 1
# A foot steps again when it would land this far from where it stands, or turned by this much (25 degrees).
_POSITION_TOLERANCE_M = 0.09
_TURN_TOLERANCE_RAD = 0.436
_DECISION_S = 0.04
# Sole to sole, between the lines through both ankles.
_LEAST_FOOT_GAP_M = 0.085
_PASSING_GAP_M = 0.105
_FARTHEST_ASIDE_M = 0.15
_FOOT_LENGTH_M = 0.27
# When in its stance a foot has the body over its ankle: before half, as the second half is spent rolling over the ball.
_BODY_OVER_ANKLE = 0.41
# A foot lands at most this far from under the body, in heights of the hip: a person who starts or stops takes shorter
# steps, so it is so much at rest and so much more per m/s.
_LANDING_AT_REST, _LANDING_PER_MPS = 0.3, 0.1
# A foot lifts before the body has gone this far from over it, in heights of the hip.
_FARTHEST_BEHIND = 0.57
_LEAST_DOUBLE_SUPPORT_S = 0.06
_LEAST_SUPPORT_S = 0.18
_PACE_WINDOW_S = 0.8
# Where the floor is looked at under a sole, relative to the ankle: ahead and to the left.
_SOLE_M = np.array([(ahead, left) for ahead in (-0.08, -0.02, 0.05, 0.12, 0.19) for left in (-0.045, 0.0, 0.045)])


@dataclass(frozen=True)
class StepTiming:
    """Duration of a gait cycle (two steps) and of the parts a foot spends on the floor and in the air, seconds."""

    cycle_s: float
    support_s: float
    swing_s: float


def step_timing(
    speed_mps: float, turn_rps: float, hip_height_m: float, cycle_factor: float, run_weight: float = 0.0
) -> StepTiming:
    """Timing of steps at a pace, walking (``run_weight`` 0) to running (1).

    Length of a cycle over hip height = 1.346 sqrt(speed over hip height), support = 0.752 cycle - 0.143 s: Inman,
    Ralston and Todd, Human Walking (1981), in the form of Boulic, Magnenat-Thalmann and Thalmann, A global human
    walking model with real-time kinematic personification, The Visual Computer 6 (1990). Turning counts as pace, so
    that a turn on the spot is stepped through; very slow paces take shorter steps instead of ever slower ones.
    Joggers keep to about 160 steps a minute, and each foot to the floor for two fifths of a cycle or less, so that both
    are in the air in between: Novacheck, The biomechanics of running, Gait and Posture 7 (1998).
    """
    pace = float(np.hypot(speed_mps, 0.7 * turn_rps)) / hip_height_m
    cycle_s = float(np.clip(1.346 / np.sqrt(max(pace, 1e-6)), 0.85, 1.6)) * cycle_factor
    support_s = 0.752 * cycle_s - 0.143
    jog_s = (0.76 - 0.03 * (speed_mps - 2.0)) * np.sqrt(hip_height_m / 0.88) * cycle_factor
    cycle_s += run_weight * (jog_s - cycle_s)
    support_s += run_weight * (float(np.clip(0.42 - 0.06 * (speed_mps - 2.0), 0.3, 0.44)) * jog_s - support_s)
    return StepTiming(cycle_s, support_s, cycle_s - support_s)


@dataclass(frozen=True)
class Plant:
    """A foot on the floor: the floor point under its ankle, its yaw, and when it lands and lifts.

    ``dodge_m`` is how far (x, y) the swing that leads here bends aside to pass the other foot; ``run_weight`` how much
    of a running step it ends (0 to 1).
    """

    position_m: Float64[np.ndarray, "3"]
    yaw_rad: float
    land_s: float
    lift_s: float
    dodge_m: Float64[np.ndarray, "2"]
    run_weight: float = 0.0


@dataclass(frozen=True)
class _Place:
    position_m: Float64[np.ndarray, "3"]
    yaw_rad: float


class FootstepPlanner:
    """Places each foot where the body axis will pass over it in the middle of its stance."""

    def __init__(
        self,
        path: RoutePath,
        style: GaitStyle,
        hip_height_m: float,
        ankle_ahead_m: float,
        ground: Ground,
        rng: np.random.Generator,
    ) -> None:
        self._path = path
        self._style = style
        self._hip_height_m = hip_height_m
        self._ankle_ahead_m = ankle_ahead_m
        self._ground = ground
        self._rng = rng

    def plan(self) -> tuple[tuple[Plant, ...], tuple[Plant, ...]]:
        """The left and the right foot's plants in order; the first stands from the start, the last stays for good."""
        time_s = -MARGIN_S + 0.5 + self._style.phase_s
        places = [self._ideal(side, time_s) for side in (LEFT, RIGHT)]
        standing = [
            Plant(self._grounded(place.position_m, place.yaw_rad), place.yaw_rad, -np.inf, np.inf, np.zeros(2))
            for place in places
        ]
        done: tuple[list[Plant], list[Plant]] = ([], [])
        turn = self._style.first_side
        while time_s < self._path.end_s + 1.0:
            timing = self._timing(time_s)
            side = self._next_side(standing, turn, time_s + timing.swing_s)
            if side is None:
                turn = self._opening_side(time_s, turn)
                time_s += _DECISION_S
                continue
            old = standing[side]
            done[side].append(replace(old, lift_s=time_s))
            standing[side] = self._step(side, old, standing[1 - side], time_s, timing)
            turn = 1 - side
            time_s = self._next_lift_s(standing[turn], time_s, timing)
        return (*done[LEFT], standing[LEFT]), (*done[RIGHT], standing[RIGHT])

    def _timing(self, time_s: float) -> StepTiming:
        """Timing of a step that begins now."""
        moments_s = time_s + np.linspace(0.0, _PACE_WINDOW_S, 9)
        speed_mps = float(self._path.speed_mps(moments_s).mean())
        turn_rps = float(self._path.turn_rps(moments_s).mean())
        run_weight = float(self._path.run_weight(moments_s).mean())
        return step_timing(speed_mps, turn_rps, self._hip_height_m, self._style.cycle_factor, run_weight)

    def _next_side(self, standing: list[Plant], turn: int, land_s: float) -> int | None:
        """The foot to lift now: the one whose turn it is if it has to, else the other if it has to."""
        if self._need(standing[turn], turn, land_s) >= 1.0:
            return turn
        if self._need(standing[1 - turn], 1 - turn, land_s) >= 1.0:
            return 1 - turn
        return None

    def _next_lift_s(self, plant: Plant, lift_s: float, timing: StepTiming) -> float:
        """When the standing foot lifts: half a cycle after the other, sooner where the body would leave it behind."""
        runs = timing.support_s < 0.5 * timing.cycle_s
        earliest_s = lift_s + timing.swing_s + _LEAST_DOUBLE_SUPPORT_S
        if runs:
            earliest_s = max(plant.land_s + _LEAST_SUPPORT_S, lift_s + 0.25 * timing.cycle_s)
        latest_s = max(lift_s + 0.5 * timing.cycle_s, earliest_s)
        moments_s = np.linspace(earliest_s, latest_s, 8)
        away_m = np.linalg.norm(self._path.position_m(moments_s)[:, :2] - plant.position_m[:2], axis=1)
        left_behind = away_m > _FARTHEST_BEHIND * self._hip_height_m
        return float(moments_s[left_behind.argmax()]) if left_behind.any() else latest_s

    def _opening_side(self, time_s: float, otherwise: int) -> int:
        """The foot that a standing person turns with first: the one on the inside of the turn."""
        heading_rad = self._path.heading_rad(np.array([time_s, time_s + _PACE_WINDOW_S]))
        turn_rad = float(heading_rad[1] - heading_rad[0])
        if abs(turn_rad) < 0.15:
            return otherwise
        return LEFT if turn_rad > 0 else RIGHT

    def _need(self, plant: Plant, side: int, land_s: float) -> float:
        ideal = self._ideal(side, land_s)
        distance_m = float(np.linalg.norm(ideal.position_m[:2] - plant.position_m[:2]))
        turn_rad = abs(ideal.yaw_rad - plant.yaw_rad)
        return max(distance_m / _POSITION_TOLERANCE_M, turn_rad / _TURN_TOLERANCE_RAD)

    def _ideal(self, side: int, time_s: float) -> _Place:
        moment_s = np.array([time_s])
        heading_rad = float(self._path.heading_rad(moment_s)[0])
        walking = float(np.clip(self._path.speed_mps(moment_s)[0] / 0.8, 0.0, 1.0))
        half_m = (1 - walking) * self._style.stand_half_width_m + walking * self._style.walk_half_width_m
        half_m *= 1.0 - 0.4 * float(self._path.run_weight(moment_s)[0])
        outward = 1.0 if side == LEFT else -1.0
        ahead, left = _axes(heading_rad)
        position_m = self._path.position_m(moment_s)[0].copy()
        position_m[:2] += self._ankle_ahead_m * ahead + outward * half_m * left
        return _Place(position_m, heading_rad + outward * self._style.toe_out_rad)

    def _step(self, side: int, old: Plant, other: Plant, lift_s: float, timing: StepTiming) -> Plant:
        land_s = lift_s + timing.swing_s
        ideal = self._ideal(side, land_s + _BODY_OVER_ANKLE * timing.support_s)
        position_m = self._within_reach(ideal.position_m, self._ideal(side, land_s).position_m, land_s)
        position_m[:2] += np.clip(self._rng.normal(0.0, 0.007, 2), -0.015, 0.015)
        yaw_rad = ideal.yaw_rad + float(np.clip(self._rng.normal(0.0, 0.02), -0.05, 0.05))
        outward = 1.0 if side == LEFT else -1.0
        _, left = _axes(yaw_rad)
        gap_m = outward * float((position_m[:2] - other.position_m[:2]) @ left)
        position_m[:2] += float(np.clip(_LEAST_FOOT_GAP_M - gap_m, 0.0, _FARTHEST_ASIDE_M)) * outward * left
        aside = outward * _axes(0.5 * (old.yaw_rad + yaw_rad))[1]
        dodge_m = _passing_room_m(old.position_m[:2], position_m[:2], other.position_m[:2], aside) * aside
        run_weight = float(self._path.run_weight(np.array([lift_s, land_s])).mean())
        return Plant(self._grounded(position_m, yaw_rad), yaw_rad, land_s, np.inf, dodge_m, run_weight)

    def _grounded(self, position_m: Float64[np.ndarray, "3"], yaw_rad: float) -> Float64[np.ndarray, "3"]:
        """The place at the height of the highest floor under the sole."""
        ahead, left = _axes(yaw_rad)
        sole_m = position_m[:2] + _SOLE_M @ np.stack([ahead, left])
        height_m = self._ground.height_m(sole_m, np.full(len(sole_m), position_m[2]))
        return np.array([position_m[0], position_m[1], height_m.max()])

    def _within_reach(
        self, wanted_m: Float64[np.ndarray, "3"], under_body_m: Float64[np.ndarray, "3"], land_s: float
    ) -> Float64[np.ndarray, "3"]:
        ahead_m = wanted_m - under_body_m
        speed_mps = float(self._path.speed_mps(np.array([land_s]))[0])
        farthest_m = (_LANDING_AT_REST + _LANDING_PER_MPS * speed_mps) * self._hip_height_m
        return under_body_m + ahead_m * min(1.0, farthest_m / max(float(np.linalg.norm(ahead_m)), 1e-9))


def _axes(yaw_rad: float) -> tuple[Float64[np.ndarray, "2"], Float64[np.ndarray, "2"]]:
    ahead = np.array([np.cos(yaw_rad), np.sin(yaw_rad)])
    return ahead, np.array([-ahead[1], ahead[0]])


def _passing_room_m(
    start_m: Float64[np.ndarray, "2"],
    end_m: Float64[np.ndarray, "2"],
    other_m: Float64[np.ndarray, "2"],
    aside: Float64[np.ndarray, "2"],
) -> float:
    """How far a swing must bend aside, at its middle, to pass the standing foot."""
    fraction = np.linspace(0.15, 0.85, 15)
    offset_m = start_m + fraction[:, None] * (end_m - start_m) - other_m
    beside_m = offset_m @ aside
    along_m = np.sqrt(np.maximum(np.sum(offset_m**2, axis=1) - beside_m**2, 0.0))
    short_m = np.where(along_m < _FOOT_LENGTH_M, np.maximum(_PASSING_GAP_M - beside_m, 0.0), 0.0)
    return float(np.clip(np.max(short_m / np.sin(np.pi * fraction) ** 2), 0.0, 0.2))
