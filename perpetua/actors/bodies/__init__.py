"""Body models; importing this package enters them in ``BODY_MODELS``."""

from perpetua.actors.bodies import anny as anny
from perpetua.actors.bodies import smplx_body as smplx_body
from perpetua.actors.bodies.source import BODY_MODELS as BODY_MODELS
