"""Take the roles of docstrings, as ``:func:`adjust` ``, which editors read, out of the pages."""

from __future__ import annotations

import re
from typing import Any

ROLE = re.compile(r":(?:attr|class|data|exc|func|meth|mod):(?=<code>|<a )")


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Leave the name that stands behind a role."""
    return ROLE.sub("", html)
