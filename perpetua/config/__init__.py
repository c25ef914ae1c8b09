"""The one schema of all settings, how it is read, and its reference page."""

from perpetua.config.load import PRESETS, load_config, presets
from perpetua.config.schema import Config, SequenceConfig, field_table

__all__ = ["PRESETS", "Config", "SequenceConfig", "field_table", "load_config", "presets"]
