# SPDX-License-Identifier: Apache-2.0
"""docs/measured: the pages, the marks of those that today's code did not write, and README's headline figures."""
import hashlib
import json
import re

from campaigns import buses, climbs, cost, estimation, mute, perception, reality, settings, stairs
from campaigns.engine import ROOT, code_hash, commit
from campaigns.paper import trials as paper

TABLES = {**climbs.TABLES, **paper.TABLES, **buses.TABLES, **mute.TABLES, **reality.TABLES, **stairs.TABLES, **perception.TABLES, **estimation.TABLES, **settings.TABLES, **cost.TABLES}
MEASURED = ROOT / "docs/measured"
FIGURES = MEASURED / "headline.json"
STALE = "**Stale: the code has changed since this was measured.**"
BEGIN, END = "<!-- headline: written by toolchain/campaign -->", "<!-- end of headline -->"
HASH = re.compile(r"code hash `([0-9a-f]{16})`")


def hash_of(name, root=None):
    """Of what the table depends on, today."""
    root = root or ROOT
    return TABLES[name].hash(root) if name in TABLES else code_hash(root)


def figures_of():
    return json.loads(FIGURES.read_text()) if FIGURES.exists() else {}


def write_page(name, table, page, date, code):
    MEASURED.mkdir(parents=True, exist_ok=True)
    (MEASURED / f"{name}.md").write_text(
        f"# {table.title}\n\nWritten by `toolchain/campaign {name}`, not by hand: commit `{commit()}`, code hash `{code}`, {date}.\n\n"
        f"{page.text.rstrip()}\n")
    for path, text in page.files.items():
        (ROOT / path).parent.mkdir(parents=True, exist_ok=True)
        (ROOT / path).write_text(text)
    figures = figures_of()
    figures[name] = {"code": code, "figures": page.headline,
                     "files": {path: hashlib.sha256(text.encode()).hexdigest()[:16] for path, text in page.files.items()}}
    FIGURES.write_text(json.dumps(figures, indent=1, sort_keys=True) + "\n")


def headline():
    """README's table: every headline figure that was measured and is shown, with its command; older ones say so."""
    lines = ["| figure | measured | asked | repeat with |", "|---|---|---|---|"]
    for name, entry in figures_of().items():
        for line in entry["figures"].values():
            if not line.get("shown", True):
                continue
            old = "" if entry["code"] == hash_of(name) else " (of older code)"
            measured, asked = ("; ".join(f[key] for f in line["figures"]) for key in ("measured", "bound"))
            asked = "-" if set(asked) <= set("-; ") else asked + line["unit"]
            lines.append(f"| {line['what']} | {measured}{line['unit']}{old} | {asked} | `toolchain/campaign {name}` |")
    return "\n".join(lines)


def missed_bounds():
    """A sentence for each headline figure that misses what it is held to, older ones too."""
    for name, entry in figures_of().items():
        for line in entry["figures"].values():
            for f in line["figures"]:
                if f["at"] and not (f["value"] is not None and (f["value"] <= f["asked"] if f["at"] == "most" else f["value"] >= f["asked"])):
                    yield f"{name}: {line['what']}: {f['value']} where at {f['at']} {f['asked']} is asked"


def changed_files():
    """Files that a campaign wrote and somebody else changed."""
    for name, entry in figures_of().items():
        for path, digest in entry.get("files", {}).items():
            if not (ROOT / path).exists() or hashlib.sha256((ROOT / path).read_bytes()).hexdigest()[:16] != digest:
                yield f"{path}: is not what `toolchain/campaign {name}` wrote"


def write_headline():
    readme = ROOT / "README.md"
    text = readme.read_text()
    if BEGIN in text:
        start, end = text.index(BEGIN) + len(BEGIN), text.index(END)
        readme.write_text(text[:start] + "\n" + headline() + "\n" + text[end:])


def stale_pages():
    """(page, is stale, is marked) of each."""
    for page in sorted(MEASURED.glob("*.md")):
        if page.name == "README.md":
            continue
        text = page.read_text()
        found = HASH.search(text)
        yield page, found is None or found[1] != hash_of(page.stem), STALE in text


def mark_stale():
    """Marks what today's code did not write, takes the mark off what it did; README's headline follows."""
    for page, stale, marked in stale_pages():
        text = page.read_text()
        if stale and not marked:
            title, rest = text.split("\n", 1)
            page.write_text(f"{title}\n\n{STALE}\n{rest}")
        elif marked and not stale:
            page.write_text(text.replace(f"\n{STALE}\n", "", 1))
        if stale != marked:
            print(f"campaign: {page.relative_to(ROOT)}: {'marked stale' if stale else 'no longer stale'}")
    write_headline()
    return 0
