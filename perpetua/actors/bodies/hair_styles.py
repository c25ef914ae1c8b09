"""Hair styles as measures: how many locks, how long, and which way they lie."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class HairStyle:
    """A cut of hair. Styles without locks are a cap alone; without ``cap_m`` the hair is painted on the skin.

    ``length_m`` is the length of a lock, ``front_length_m`` that above the forehead, ``width_m`` its width. Locks are
    combed forward (+) or back (-) by ``sweep`` and to the sides of a parting by ``part``; ``tousle`` is how much
    neighbours differ in direction, ``lift`` how far tips stand off the skull in lengths of the lock, ``curl_m`` the
    height of their waves. The cap under them is ``cap_m`` thick with bumps of ``bumps_m``; ``line_shift_m`` raises the
    hairline. ``frizzy`` hair shows curls instead of strands; ``tied`` hair is combed to a bun or a ponytail.
    """

    name: str
    locks: int = 0
    length_m: float = 0.0
    front_length_m: float = 0.0
    width_m: float = 0.0
    lift: float = 0.0
    sweep: float = 0.0
    part: float = 0.0
    cap_m: float = 0.0
    bumps_m: float = 0.0
    curl_m: float = 0.0
    line_shift_m: float = 0.0
    tousle: float = 0.0
    frizzy: bool = False
    tied: Literal["bun", "ponytail"] | None = None


_ROWS = (
    HairStyle(
        name="cropped",
    ),
    HairStyle(
        name="buzzed",
        cap_m=0.004,
        bumps_m=0.0004,
        frizzy=True,
    ),
    HairStyle(
        name="short",
        locks=620,
        length_m=0.036,
        front_length_m=0.046,
        width_m=0.0085,
        lift=0.05,
        sweep=0.5,
        cap_m=0.009,
        bumps_m=0.001,
        curl_m=0.001,
        tousle=0.16,
    ),
    HairStyle(
        name="side-parted",
        locks=620,
        length_m=0.046,
        front_length_m=0.075,
        width_m=0.0090,
        lift=0.04,
        part=0.9,
        cap_m=0.011,
        bumps_m=0.001,
        curl_m=0.001,
        tousle=0.09,
    ),
    HairStyle(
        name="swept-back",
        locks=620,
        length_m=0.050,
        front_length_m=0.080,
        width_m=0.0090,
        lift=0.05,
        sweep=-1.4,
        cap_m=0.013,
        bumps_m=0.001,
        curl_m=0.001,
        line_shift_m=0.003,
        tousle=0.07,
    ),
    HairStyle(
        name="bob",
        locks=560,
        length_m=0.200,
        front_length_m=0.215,
        width_m=0.0140,
        part=1.0,
        cap_m=0.013,
        bumps_m=0.001,
        curl_m=0.001,
        tousle=0.04,
    ),
    HairStyle(
        name="long",
        locks=560,
        length_m=0.340,
        front_length_m=0.350,
        width_m=0.0140,
        sweep=-0.3,
        part=1.0,
        cap_m=0.012,
        bumps_m=0.001,
        curl_m=0.003,
        tousle=0.04,
    ),
    HairStyle(
        name="wavy",
        locks=560,
        length_m=0.280,
        front_length_m=0.290,
        width_m=0.0150,
        sweep=-0.1,
        part=1.0,
        cap_m=0.014,
        bumps_m=0.001,
        curl_m=0.007,
        tousle=0.07,
    ),
    HairStyle(
        name="curly",
        locks=700,
        length_m=0.040,
        front_length_m=0.040,
        width_m=0.0110,
        lift=0.30,
        sweep=0.2,
        cap_m=0.020,
        bumps_m=0.005,
        curl_m=0.006,
        tousle=0.8,
        frizzy=True,
    ),
    HairStyle(
        name="afro",
        locks=800,
        length_m=0.022,
        front_length_m=0.022,
        width_m=0.011,
        lift=0.5,
        cap_m=0.042,
        bumps_m=0.005,
        curl_m=0.004,
        line_shift_m=0.002,
        tousle=1.0,
        frizzy=True,
    ),
    HairStyle(
        name="tied-up",
        locks=420,
        length_m=0.060,
        front_length_m=0.070,
        width_m=0.0090,
        cap_m=0.009,
        bumps_m=0.0005,
        tousle=0.03,
        tied="bun",
    ),
    HairStyle(
        name="ponytail",
        locks=420,
        length_m=0.060,
        front_length_m=0.070,
        width_m=0.0090,
        cap_m=0.009,
        bumps_m=0.0005,
        tousle=0.03,
        tied="ponytail",
    ),
)
STYLES = {style.name: style for style in _ROWS}
