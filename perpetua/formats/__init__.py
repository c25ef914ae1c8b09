"""Writers and readers of file layouts. Importing this package enters every exporter in ``EXPORTERS``."""

from perpetua.formats import tapvid_mv
from perpetua.formats.source import EXPORTERS

__all__ = ["EXPORTERS", "tapvid_mv"]
