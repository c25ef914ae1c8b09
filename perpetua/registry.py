"""Name -> class tables for what users can add: room sources, bodies, motion sources, exporters.

What comes with Perpetua is named in the table and imported when it is looked up. A package installed beside Perpetua
adds to a table by an entry point of its group, a script of the user's by the decorator ``register``. What comes with
Perpetua cannot be replaced: an entry point that takes its name is never used, and ``plug_ins`` says so.
"""

import difflib
import importlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar, cast

from perpetua.errors import ConfigError

Entry = TypeVar("Entry")

BUILT_IN = "perpetua"


@dataclass(frozen=True)
class PlugIn:
    """An entry of an installed package; ``fault`` says why it cannot be used and what to do, empty if it can."""

    kind: str
    name: str
    package: str
    fault: str = ""


class Registry(Generic[Entry]):
    """A table of interchangeable implementations.

    Args:
        kind: what errors call an entry, for example the setting that names it.
        group: entry points of this group, of all installed packages, are entries too.
        built_in: entries that come with Perpetua, each as "module:class".
    """

    def __init__(self, kind: str, group: str, built_in: Mapping[str, str]) -> None:
        self.kind, self.group = kind, group
        self._built_in = dict(built_in)
        self._entered: dict[str, Entry] = {}

    def register(self, name: str) -> Callable[[Entry], Entry]:
        """Decorator that enters a class under ``name``; a name can be taken once.

        Raises:
            ValueError: the name is taken.
        """

        def enter(entry: Entry) -> Entry:
            if name in self:
                raise ValueError(f"{self.kind} '{name}' is already registered by {self.origin(name)}")
            self._entered[name] = entry
            return entry

        return enter

    def origin(self, name: str) -> str:
        """Where an entry comes from: "perpetua", the name and version of a package, or "this program".

        Raises:
            ConfigError: there is no such entry.
        """
        if name in self._entered:
            return "this program"
        if name in self._built_in:
            return BUILT_IN
        if name in self._offered:
            return ", ".join(_package(point) for point in self._offered[name])
        raise self._unknown(name)

    def package(self, name: str) -> str | None:
        """Name and version of the installed package that an entry comes from; None for all other entries.

        Raises:
            ConfigError: there is no such entry.
        """
        origin = self.origin(name)
        return origin if name not in self._entered and name not in self._built_in else None

    def plug_ins(self) -> list[PlugIn]:
        """What installed packages offer, usable or not; each is imported to find out."""
        names = sorted({*self._offered, *self._shadowed})
        return [
            PlugIn(self.kind, name, _package(point), self._fault(name))
            for name in names
            for point in self._offered.get(name, self._shadowed.get(name, []))
        ]

    def refresh(self) -> None:
        """Looks at the installed packages again, for one that was installed since this program began."""
        self.__dict__.pop("_points", None)

    def _fault(self, name: str) -> str:
        if name in self._shadowed:
            return f"perpetua has a '{name}' of its own, which is used: give the entry point another name"
        try:
            self._load(name, self._offered[name])
        except ConfigError as error:
            return str(error)
        return ""

    def __getitem__(self, name: str) -> Entry:
        """The class entered under a name.

        Raises:
            ConfigError: there is none, two packages offer it, or its package cannot be imported.
        """
        if name in self._entered:
            return self._entered[name]
        if name in self._built_in:
            module, _, attribute = self._built_in[name].partition(":")
            return cast(Entry, getattr(importlib.import_module(module), attribute))
        if name in self._offered:
            return cast(Entry, self._load(name, self._offered[name]))
        raise self._unknown(name)

    def __contains__(self, name: object) -> bool:
        return name in self._entered or name in self._built_in or name in self._offered

    def __iter__(self) -> Iterator[str]:
        return iter(sorted({*self._entered, *self._built_in, *self._offered}))

    @cached_property
    def _points(self) -> dict[str, list[EntryPoint]]:
        """Entry points of the group by name."""
        found: dict[str, list[EntryPoint]] = {}
        for point in entry_points(group=self.group):
            found.setdefault(point.name, []).append(point)
        return found

    @property
    def _offered(self) -> dict[str, list[EntryPoint]]:
        return {name: points for name, points in self._points.items() if name not in self._built_in}

    @property
    def _shadowed(self) -> dict[str, list[EntryPoint]]:
        return {name: points for name, points in self._points.items() if name in self._built_in}

    def _load(self, name: str, points: list[EntryPoint]) -> Any:
        if len(points) > 1:
            raise ConfigError(f"{self.kind} '{name}' is offered by {self.origin(name)}: uninstall all but one of them")
        [point] = points
        try:
            entry = point.load()
        except Exception as error:
            raise ConfigError(
                f"{self.kind} '{name}' comes from {_package(point)}, which cannot be imported "
                f"({type(error).__name__}: {error}): mend or uninstall that package"
            ) from error
        if not isinstance(entry, type):
            raise ConfigError(
                f"{self.kind} '{name}' of {_package(point)} must be a class, and '{point.value}' is a "
                f"{type(entry).__name__}: name the class in the entry point"
            )
        return entry

    def _unknown(self, name: str) -> ConfigError:
        near = difflib.get_close_matches(name, self, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        known = [self._said(known) for known in self]
        return ConfigError(f"{self.kind} must be one of {', '.join(known)}, not '{name}'{hint}")

    def _said(self, name: str) -> str:
        return f"'{name}'" if name in self._built_in else f"'{name}' (of {self.origin(name)})"


def _package(point: EntryPoint) -> str:
    return "an unknown package" if point.dist is None else f"{point.dist.name} {point.dist.version}"
