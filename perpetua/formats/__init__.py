"""Writers and readers of file layouts. Importing this package enters every exporter in ``EXPORTERS``."""

from perpetua.formats import kubric, rerun_recording, tapvid3d
from perpetua.formats.source import EXPORTERS

__all__ = ["EXPORTERS", "kubric", "rerun_recording", "tapvid3d"]
