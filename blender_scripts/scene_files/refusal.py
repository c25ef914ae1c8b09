# SPDX-License-Identifier: GPL-3.0-or-later
"""Why a scene file cannot become a room."""


class Refused(Exception):
    """The file cannot become a room; ``rule`` is a short name of what it breaks."""

    def __init__(self, rule: str, message: str) -> None:
        super().__init__(message)
        self.rule = rule
