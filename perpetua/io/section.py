"""The base of every section of the config; the sections live with their stages, ``perpetua.config`` joins them."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A frozen group of settings. Every field says its meaning, unit and range in its ``Field``."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
