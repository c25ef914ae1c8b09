"""Every exporter, by name: importing this module enters them in ``EXPORTERS``."""

from perpetua.formats import kubric, rerun_recording, tapvid3d
from perpetua.formats.source import EXPORTERS

__all__ = ["EXPORTERS", "kubric", "rerun_recording", "tapvid3d"]
