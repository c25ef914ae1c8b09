"""Whether the figures of bodies in motion keep to the hard limits of the settings."""

from perpetua.actors.checks.figures import ActorFigures, ActorReport
from perpetua.actors.checks.penetration import Worst
from perpetua.actors.config import ValidationConfig
from perpetua.errors import ActorError


def check_limits(report: ActorReport, config: ValidationConfig) -> None:
    """Raises ActorError for the first figure of a report that breaks a limit."""
    for figures in report.actors:
        _check_slide(figures, config)
        name = f"actor {figures.actor}"
        _check(figures.scene_depth, config.max_scene_depth_m, name, "max_scene_depth_m", "goes", "into")
        _check(figures.path_error, config.max_path_error_m, name, "max_path_error_m", "strays", "from")
        for worst, percentile_m, limit_m, key, verb, preposition in (
            (
                figures.sole_penetration, figures.sole_penetration_99th_m, config.max_sole_penetration_m,
                "max_sole_penetration_m", "sinks", "into",
            ),
            (
                figures.floating, figures.floating_99th_m, config.max_floating_m, "max_floating_m", "floats", "above",
            ),
        ):  # fmt: skip
            if percentile_m > limit_m:
                _check(worst, limit_m, name, key, verb, preposition)
        if figures.joint_excess_rad > config.max_joint_excess_rad:
            raise ActorError(
                f"the {figures.joint_excess_at} of {name} is {figures.joint_excess_rad:.2f} rad beyond what people can "
                f"do; at most {config.max_joint_excess_rad:g} rad is allowed: choose another seed or raise "
                "actors.validation.max_joint_excess_rad"
            )
    for pair in report.pairs:
        nearest = int(pair.distance_m.argmin())
        if -pair.distance_m[nearest] > config.max_actor_overlap_m:
            raise ActorError(
                f"actors {pair.actors[0]} and {pair.actors[1]} are {-pair.distance_m[nearest]:.3f} m in each other at "
                f"frame {pair.frames[nearest]}; at most {config.max_actor_overlap_m:g} m is allowed: raise "
                "actors.routes.separation_m, lower actors.count or choose a larger room"
            )


def _check_slide(figures: ActorFigures, config: ValidationConfig) -> None:
    for speed_mps, what, limit_mps, key in (
        (figures.slide_95th_mps, "95th percentile", config.max_slide_mps, "max_slide_mps"),
        (figures.slide_median_mps, "median", config.max_median_slide_mps, "max_median_slide_mps"),
    ):
        if speed_mps > limit_mps:
            raise ActorError(
                f"the soles of actor {figures.actor} slide at {speed_mps:.3f} m/s ({what}) while they stand; "
                f"at most {limit_mps:g} m/s is allowed: choose another seed or raise actors.validation.{key}"
            )


def _check(worst: Worst, limit_m: float, name: str, key: str, verb: str, preposition: str) -> None:
    if worst.value_m > limit_m:
        raise ActorError(
            f"{name} {verb} {worst.value_m:.3f} m {preposition} {worst.place} at frame {worst.frame}; at most "
            f"{limit_m:g} m is allowed: choose another seed, raise navigation.body_radius_m for more room, or raise "
            f"actors.validation.{key}"
        )
