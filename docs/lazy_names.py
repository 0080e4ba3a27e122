"""Read names of the package that are loaded, and dataclasses that are made, when they are first asked for."""

from __future__ import annotations

from typing import Any

from griffe import Alias, Extension, Module


class Declared(Extension):
    """Takes what a module hands on for what it is."""

    def on_alias_instance(self, *, alias: Alias, **_: Any) -> None:
        """Let a dataclass of `photogram.lazy_dataclasses` be one of the standard library: with parameters."""
        for name in ("converting_dataclass", "dataclass", "field"):
            if alias.target_path == f"photogram.lazy_dataclasses.{name}":
                alias.target_path = f"dataclasses.{name.removeprefix('converting_')}"

    def on_module_members(self, *, mod: Module, **_: Any) -> None:
        """Let the names that a package's stub imports, which `lazy_loader` loads, be public."""
        if mod.is_init_module and str(mod.filepath).endswith(".pyi"):
            mod.exports = list(mod.imports)
