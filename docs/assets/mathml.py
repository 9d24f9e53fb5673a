"""Formulas as MathML, which browsers draw without scripts or downloads."""

from __future__ import annotations

import html
import re
from typing import Any

from latex2mathml.converter import convert

_FORMULA = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\(?P<open>[(\[])(?P<tex>.*?)\\[)\]]</(?P=tag)>', re.S
)


def on_page_content(content: str, **_: Any) -> str:
    """Return a page's HTML with every formula turned into MathML."""

    def drawn(found: re.Match[str]) -> str:
        block = found["open"] == "["
        return convert(html.unescape(found["tex"]), display="block" if block else "inline")

    return _FORMULA.sub(drawn, content)
