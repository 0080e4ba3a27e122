"""Validation and conversion of arguments of public functions."""

from photogram.arguments.annotations import check_arguments, path

__all__ = ["check_arguments", "path"]
