"""Read dataclasses of `photogram.lazy_dataclasses` as those of the standard library: with parameters."""

from __future__ import annotations

from typing import Any

from griffe import Alias, Extension


class Declared(Extension):
    """Takes what the module hands on for what it is."""

    def on_alias_instance(self, *, alias: Alias, **_: Any) -> None:
        """Let a name lead where it comes from."""
        alias.target_path = alias.target_path.replace("photogram.lazy_dataclasses.", "dataclasses.")
