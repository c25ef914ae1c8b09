"""``python -m perpetua`` is ``perpetua``."""

from perpetua.cli.app import main

main(prog_name="perpetua")
