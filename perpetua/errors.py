"""The tree of errors a user can meet.

A message states the rule, the value that broke it, and the remedy. ``exit_code`` is what the command line
returns: 2 where the user's input is at fault, 1 where the work failed.
"""


class PerpetuaError(Exception):
    """Base of every error that is meant for a user's eyes."""

    exit_code = 1


class InputError(PerpetuaError):
    """Something that the user gave is wrong."""

    exit_code = 2


class ConfigError(InputError):
    """A config key or value is not one of the schema's."""


class AssetError(InputError):
    """An outside asset (model file, texture, program) is missing or not what it should be."""


class SequenceFormatError(InputError):
    """A sequence on disk does not follow the file layout."""


class EnvironmentSetupError(InputError):
    """A library or program that Perpetua needs is not installed."""


class StageError(PerpetuaError):
    """A stage could not make its output."""


class RoomError(StageError):
    """No acceptable room came out of the room source."""


class NavigationError(StageError):
    """A room has no floor that people can use."""


class RouteError(StageError):
    """No set of routes keeps the hard limits."""


class ActorError(StageError):
    """Bodies or their motion break a hard limit."""


class CameraError(StageError):
    """No set of camera paths passes the collision audit."""


class RenderError(StageError):
    """Blender could not render the frames."""


class TrackError(StageError):
    """Too few points are visible to make the wanted tracks."""


class AuditError(StageError):
    """A finished sequence does not pass its own audit."""


class GenerationError(PerpetuaError):
    """Some rooms failed; ``failures`` has the reason of each, by room."""

    def __init__(self, failures: dict[int, str], wanted: int, exit_code: int) -> None:
        reasons = "\n".join(f"room {room}: {reason}" for room, reason in sorted(failures.items()))
        super().__init__(f"{len(failures)} of {wanted} rooms failed:\n{reasons}")
        self.failures = failures
        self.exit_code = exit_code
