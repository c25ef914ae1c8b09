"""The extras of this package: what they bring, and what is said where one is missing."""

from perpetua.errors import EnvironmentSetupError

EXTRAS = ("infinigen", "slurm", "rerun")


def missing_extra(wish: str, package: str, extra: str, otherwise: str = "") -> EnvironmentSetupError:
    """The error for what needs a package that is not installed.

    Args:
        wish: what the user asked for.
        package: the package that it needs.
        extra: one of ``EXTRAS``, which brings the package.
        otherwise: what the user could do instead, as the end of a sentence.
    """
    end = f", or {otherwise}" if otherwise else ""
    return EnvironmentSetupError(
        f"{wish} needs the package {package}, which is not installed: run pip install 'perpetua[{extra}]' in this "
        f"environment{end}"
    )
