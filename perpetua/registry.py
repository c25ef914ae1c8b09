"""Name -> class tables for what users can add: room sources, body models, motion sources, exporters."""

import difflib
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

from perpetua.errors import ConfigError

Entry = TypeVar("Entry")


class Registry(Generic[Entry]):
    """A table of interchangeable implementations, filled by a decorator in each implementation's own file."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._entries: dict[str, Entry] = {}

    def register(self, name: str) -> Callable[[Entry], Entry]:
        """Decorator that enters a class under ``name``; a name can be taken once."""

        def enter(entry: Entry) -> Entry:
            if name in self._entries:
                raise ValueError(f"{self.kind} '{name}' is already registered")
            self._entries[name] = entry
            return entry

        return enter

    def __getitem__(self, name: str) -> Entry:
        if name not in self._entries:
            near = difflib.get_close_matches(name, self._entries, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            raise ConfigError(f"{self.kind} must be one of {sorted(self._entries)}, not '{name}'{hint}")
        return self._entries[name]

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(self._entries))
