"""``python -m perpetua`` is ``perpetua``."""

from perpetua.cli import main

main(prog_name="perpetua")
