"""Take the roles of docstrings, as ``:func:`adjust` ``, which editors read, out of the pages."""

from __future__ import annotations

import re
from typing import Any

from mkdocs.exceptions import PluginError

ROLE = r":(?:attr|class|data|exc|func|meth|mod):"


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Leave the name that stands behind a role; refuse one whose name is no code, as in a type."""
    shown = re.sub(f"{ROLE}(?=<code>|<a )", "", html)
    if left := re.search(f".*{ROLE}.*", shown):
        raise PluginError(f"{page.file.src_uri}: a role where no markup is read: {left[0].strip()}")
    return shown
