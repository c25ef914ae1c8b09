"""The command line: each command parses its options, calls ``perpetua.runs`` and prints; none decides."""

from perpetua.cli.app import main

__all__ = ["main"]
