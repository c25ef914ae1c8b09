"""Entries of outside assets, installed as ``perpetua.resources.assets_manifest``."""
