"""Settings of the export stage."""

from pydantic import Field

from perpetua.config_base import Section


class ExportConfig(Section):
    """Where a finished sequence goes and what is kept."""

    split: str = Field("train", pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$", description="folder of the data split")
