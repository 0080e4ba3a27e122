"""Arguments of public functions: checked, converted, and refused by name."""

from photogram.arguments.annotations import check_arguments, path

__all__ = ["check_arguments", "path"]
