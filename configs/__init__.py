"""Presets and lists of actions, installed as ``perpetua.resources.configs``."""
