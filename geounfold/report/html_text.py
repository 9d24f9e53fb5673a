"""Numbers, lists and tables as HTML; whatever comes from a user is escaped here."""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Mapping
from typing import Any


def text(value: object) -> str:
    """Return a value as HTML text that can hold no tag and end no attribute.

    Examples
    --------
    >>> text("</script>")
    '&lt;/script&gt;'
    """
    return html.escape(str(value), quote=True)


def number(value: object) -> str:
    """Write a number as people read it; anything else as it is."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1e5 else f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(number(v) for v in value)
    return str(value)


def json_for_script(content: object) -> str:
    r"""Return JSON that can be put inside a ``<script>``: no tag or comment can begin in it.

    Examples
    --------
    >>> json_for_script(["</script>"])
    '["\\u003c/script\\u003e"]'
    """
    plain = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return plain.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def flat(nested: object, prefix: str = "") -> dict[str, Any]:
    """Return nested mappings as one, with dotted names."""
    if not isinstance(nested, Mapping):
        return {prefix: nested} if prefix else {}
    out: dict[str, Any] = {}
    for key, value in nested.items():
        out.update(flat(value, f"{prefix}.{key}" if prefix else str(key)))
    return out


def mapping(value: object) -> Mapping[str, Any]:
    """Return a mapping as it is, and anything else as an empty one."""
    return value if isinstance(value, Mapping) else {}


def section(title: str, content: str) -> str:
    """Return a titled section; nothing if there is no content."""
    return f"<section>\n<h2>{text(title)}</h2>\n{content}\n</section>" if content else ""


def folded_up(title: str, content: str, name: str = "") -> str:
    """Return a section that opens on demand; nothing if there is no content."""
    if not content:
        return ""
    known = f' id="{text(name)}"' if name else ""
    return f"<details{known}><summary>{text(title)}</summary>\n{content}</details>"


def bullets(items: Iterable[object]) -> str:
    """Return a list of sentences; nothing if there are none."""
    lines = "".join(f"<li>{text(item)}</li>" for item in items)
    return f"<ul>{lines}</ul>" if lines else ""


def pairs(values: Mapping[str, Any]) -> str:
    """Return names and values as a table of two columns; nothing if there are none."""
    rows = "".join(
        f'<tr><th scope="row">{text(k)}</th><td>{text(number(v))}</td></tr>'
        for k, v in values.items()
    )
    return f'<div class="wide" tabindex="0"><table>{rows}</table></div>' if rows else ""


def table(rows: list[dict[str, Any]]) -> str:
    """Return rows of the same keys as a table; empty when there is nothing to show."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    if not names:
        return ""
    kinds = [' class="number"' if all(map(_is_number, _column(rows, n))) else "" for n in names]
    head = "".join(f'<th scope="col"{k}>{text(n)}</th>' for n, k in zip(names, kinds, strict=True))
    lines = []
    for row in rows:
        cells = (
            f"<td{kind}>{text(number(row[name]) if name in row else '')}</td>"
            for name, kind in zip(names, kinds, strict=True)
        )
        lines.append(f"<tr>{''.join(cells)}</tr>")
    body = f"<table><tr>{head}</tr>{''.join(lines)}</table>"
    return f'<div class="wide across" tabindex="0">{body}</div>'


def bars(values: Mapping[str, float], unit: str) -> str:
    """Return named amounts as a table with a bar each, and their sum below."""
    if not values:
        return ""
    total, most = sum(values.values()), max(values.values())
    rows = "".join(
        f'<tr><th scope="row">{text(name)}</th><td class="number">{value:.2f}</td>'
        f'<td class="bar"><span style="width:{100 * value / most if most > 0 else 0:.1f}%">'
        "</span></td></tr>"
        for name, value in values.items()
    )
    last = f'<tr><th scope="row">together</th><td class="number">{total:.2f}</td><td></td></tr>'
    head = f'<tr><th scope="col">stage</th><th scope="col" class="number">{text(unit)}</th>'
    return f'<div class="wide"><table class="bars">{head}<th></th></tr>{rows}{last}</table></div>'


def copyable(name: str, title: str, content: str) -> str:
    """Return a text in a box with a button that copies it; nothing if there is no text."""
    if not content:
        return ""
    return (
        f'<div class="copyable"><div class="row"><h3>{text(title)}</h3>'
        f'<button type="button" data-copy="{text(name)}">Copy</button></div>'
        f'<pre id="{text(name)}" tabindex="0">{text(content)}</pre></div>'
    )


def _column(rows: list[dict[str, Any]], name: str) -> list[Any]:
    return [row[name] for row in rows if name in row]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | list)
