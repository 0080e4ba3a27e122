"""Write docstrings for readers of pages: without roles, with links, and with public base classes only.

A role is ``:func:`adjust` ``, which editors read. `docs/weights.md` becomes a link.
"""

from __future__ import annotations

import posixpath
import re
from typing import Any

from mkdocs.exceptions import PluginError

ROLE = r":(?:attr|class|data|exc|func|meth|mod):"
PAGE = re.compile(r"(?:<code>)?\bdocs/([\w/-]+)\.md\b(?:</code>)?")
BASES = re.compile(r'<p class="doc doc-class-bases">.*?</p>', re.DOTALL)
BASE = re.compile(r"<code>(?:(?!</code>).)*</code>", re.DOTALL)


def public_bases(bases: re.Match[str]) -> str:
    """Return the paragraph of base classes without internal ones, which have no link and no module."""
    public = [base for base in BASE.findall(bases[0]) if "<a " in base or 'title="photogram.' not in base]
    return f'<p class="doc doc-class-bases">Bases: {", ".join(public)}</p>' if public else ""


def on_page_content(html: str, page: Any, files: Any, **_: Any) -> str:
    """Remove roles and insert links; refuse a role whose name is no code, as in a type."""
    shown = re.sub(f"{ROLE}(?=<code>|<a )", "", html)
    if left := re.search(f".*{ROLE}.*", shown):
        raise PluginError(f"{page.file.src_uri}: a role where no markup is read: {left[0].strip()}")
    if not page.file.src_uri.startswith("reference/"):
        return shown

    def link(name: re.Match[str]) -> str:
        file = files.get_file_from_path(f"{name[1]}.md")
        if file is None:
            raise PluginError(f"{page.file.src_uri}: {name[0]} does not exist")
        return f'<a href="{posixpath.relpath(file.url, page.url)}/">{posixpath.basename(name[1])}</a>'

    return PAGE.sub(link, shown)


def on_post_page(output: str, **_: Any) -> str:
    """Hide internal base classes, when links are known."""
    return BASES.sub(public_bases, output)
