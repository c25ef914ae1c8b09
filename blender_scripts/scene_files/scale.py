# SPDX-License-Identifier: GPL-3.0-or-later
"""Tells from doors, ceiling and floor whether a scene's unit is what it is taken for."""

import numpy as np

from blender_scripts.scene_files.refusal import Refused

# What rooms of people have, metres: least, most, and what is usual.
# An object called door may be a handle or a cabinet's, so a small one tells nothing.
DOOR_M = (0.0, 3.5, 2.05)
CEILING_M = (1.9, 12.0, 2.6)
SHORT_SIDE_M = (1.5, 40.0, 5.0)
LONG_SIDE_M = (1.5, 40.0, 6.0)
# Metres per unit that people use: millimetres, centimetres, inches, decimetres, feet, metres, and the inverses.
USUAL_UNITS = (0.001, 0.01, 0.0254, 0.1, 0.3048, 1.0, 10.0, 39.37, 100.0, 1000.0)
NEAR_A_UNIT = 1.35


def check_scale(sides_m: np.ndarray, height_m: float | None, doors_m: list[float], metres_per_unit: float) -> None:
    """Passes a scene in which a person would feel at home.

    Args:
        sides_m: of the floor, along x and y.
        height_m: of the ceiling or walls; None where there are none.
        doors_m: heights of the objects called door.
        metres_per_unit: what these measures were made with.

    Raises:
        Refused: names the measure that is not a room's and the unit that would mend it.
    """
    measures = [("the shorter side of its floor", float(min(sides_m)), SHORT_SIDE_M)]
    measures.append(("the longer side of its floor", float(max(sides_m)), LONG_SIDE_M))
    if height_m is not None:
        measures.insert(0, ("its ceiling", height_m, CEILING_M))
    if doors_m:
        measures.insert(0, ("its tallest door", max(doors_m), DOOR_M))
    for name, value_m, (least_m, most_m, usual_m) in measures:
        if not least_m <= value_m <= most_m:
            allowed = f"{least_m:g} to {most_m:g} m" if least_m > 0.0 else f"at most {most_m:g} m"
            raise Refused(
                "scale",
                f"{name} measures {value_m:.3g} m at {metres_per_unit:g} metres per unit, and in a room that is "
                f"{allowed}: set rooms.file.metres_per_unit, perhaps to "
                f"{likely_unit(metres_per_unit * usual_m / value_m):g}, or change the scene",
            )


def likely_unit(metres_per_unit: float) -> float:
    """The usual unit near an estimate, or the estimate to two digits where none is near."""
    nearest = min(USUAL_UNITS, key=lambda unit: abs(np.log(unit / metres_per_unit)))
    ratio = nearest / metres_per_unit
    return nearest if 1.0 / NEAR_A_UNIT <= ratio <= NEAR_A_UNIT else float(f"{metres_per_unit:.2g}")
