# SPDX-License-Identifier: Apache-2.0
"""docs/measured: the pages, the marks of those that today's code did not write, and README's headline figures."""
import json
import re

from campaigns.engine import ROOT, commit

MEASURED = ROOT / "docs/measured"
FIGURES = MEASURED / "headline.json"
STALE = "**Stale: the code has changed since this was measured.**"
BEGIN, END = "<!-- headline: written by toolchain/campaign -->", "<!-- end of headline -->"
HASH = re.compile(r"code hash `([0-9a-f]{16})`")


def write_page(name, table, page, date, code):
    MEASURED.mkdir(parents=True, exist_ok=True)
    (MEASURED / f"{name}.md").write_text(
        f"# {table.title}\n\nWritten by `toolchain/campaign {name}`, not by hand: commit `{commit()}`, code hash `{code}`, {date}.\n\n"
        f"{page.text.rstrip()}\n")
    figures = json.loads(FIGURES.read_text()) if FIGURES.exists() else {}
    figures[name] = {"code": code, "figures": page.headline}
    FIGURES.write_text(json.dumps(figures, indent=1, sort_keys=True) + "\n")


def headline(code):
    """README's table: every headline figure that was measured, with its command; older ones say so."""
    figures = json.loads(FIGURES.read_text()) if FIGURES.exists() else {}
    lines = ["| figure | measured | asked | repeat with |", "|---|---|---|---|"]
    for name, entry in figures.items():
        for what, value, bound in entry["figures"].values():
            old = "" if entry["code"] == code else " (of older code)"
            lines.append(f"| {what} | {value}{old} | {bound} | `toolchain/campaign {name}` |")
    return "\n".join(lines)


def write_headline(code):
    readme = ROOT / "README.md"
    text = readme.read_text()
    if BEGIN in text:
        start, end = text.index(BEGIN) + len(BEGIN), text.index(END)
        readme.write_text(text[:start] + "\n" + headline(code) + "\n" + text[end:])


def stale_pages(code):
    """(page, is stale, is marked) of each."""
    for page in sorted(MEASURED.glob("*.md")):
        if page.name == "README.md":
            continue
        text = page.read_text()
        found = HASH.search(text)
        yield page, found is None or found[1] != code, STALE in text


def mark_stale(code):
    """Marks what today's code did not write, takes the mark off what it did; README's headline follows."""
    for page, stale, marked in stale_pages(code):
        text = page.read_text()
        if stale and not marked:
            title, rest = text.split("\n", 1)
            page.write_text(f"{title}\n\n{STALE}\n{rest}")
        elif marked and not stale:
            page.write_text(text.replace(f"\n{STALE}\n", "", 1))
        if stale != marked:
            print(f"campaign: {page.relative_to(ROOT)}: {'marked stale' if stale else 'no longer stale'}")
    write_headline(code)
    return 0
