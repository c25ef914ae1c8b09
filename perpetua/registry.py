"""Name -> class tables for what users can add: room sources, bodies, motion sources, exporters.

What comes with Perpetua is named in the table and imported when it is looked up. A package installed beside Perpetua
adds to a table by an entry point of its group, a script of the user's by the decorator ``register``.
"""

import difflib
import importlib
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar, cast

from perpetua.errors import ConfigError

Entry = TypeVar("Entry")

BUILT_IN = "perpetua"


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
        if name in self._plug_ins:
            return ", ".join(_package(point) for point in self._plug_ins[name])
        raise self._unknown(name)

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
        if name in self._plug_ins:
            return cast(Entry, self._load(name, self._plug_ins[name]))
        raise self._unknown(name)

    def __contains__(self, name: object) -> bool:
        return name in self._entered or name in self._built_in or name in self._plug_ins

    def __iter__(self) -> Iterator[str]:
        return iter(sorted({*self._entered, *self._built_in, *self._plug_ins}))

    @cached_property
    def _plug_ins(self) -> dict[str, list[EntryPoint]]:
        """Entry points by name; one that takes the name of what comes with Perpetua is left aside."""
        found: dict[str, list[EntryPoint]] = {}
        for point in entry_points(group=self.group):
            if point.name not in self._built_in:
                found.setdefault(point.name, []).append(point)
        return found

    def _load(self, name: str, points: list[EntryPoint]) -> Any:
        if len(points) > 1:
            raise ConfigError(f"{self.kind} '{name}' is offered by {self.origin(name)}: uninstall all but one of them")
        try:
            return points[0].load()
        except Exception as error:
            raise ConfigError(
                f"{self.kind} '{name}' comes from {_package(points[0])}, which cannot be imported "
                f"({type(error).__name__}: {error}): mend or uninstall that package"
            ) from error

    def _unknown(self, name: str) -> ConfigError:
        near = difflib.get_close_matches(name, self, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        known = [self._said(known) for known in self]
        return ConfigError(f"{self.kind} must be one of {', '.join(known)}, not '{name}'{hint}")

    def _said(self, name: str) -> str:
        return f"'{name}'" if name in self._built_in else f"'{name}' (of {self.origin(name)})"


def _package(point: EntryPoint) -> str:
    return "an unknown package" if point.dist is None else f"{point.dist.name} {point.dist.version}"
