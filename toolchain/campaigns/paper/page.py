# SPDX-License-Identifier: Apache-2.0
"""One content, written twice: as Markdown and as one self-contained HTML page.

A block is ("h2", text), ("p", text), ("ul", texts), ("table", header, lines) or ("figure", name, alt, caption, command);
texts may have `code` and **strong** words."""
import base64
import html as escape
import re

from campaigns.engine import rows

STYLE = """body{font:16px/1.5 system-ui,sans-serif;color:#1c2026;background:#fff;max-width:46rem;margin:0 auto;padding:1rem;overflow-wrap:break-word}
h1{font-size:1.5rem;line-height:1.25}h2{font-size:1.15rem;margin:2rem 0 .5rem;border-bottom:1px solid #d5d9df}
p,ul{margin:.5rem 0}li{margin:.35rem 0}code{font:.88em ui-monospace,monospace;white-space:nowrap;background:#f0f2f5;padding:0 .2em;border-radius:3px}
.first{background:#fdf3e7;border-left:4px solid #c4620f;padding:.1rem 1rem .5rem}.first h2{margin-top:.6rem;border:0}
.wide{overflow-x:auto;margin:.75rem 0}table{border-collapse:collapse;font-size:.85rem;font-variant-numeric:tabular-nums}
th,td{padding:.25rem .55rem;text-align:left;border-bottom:1px solid #e3e6ea;white-space:nowrap}th{background:#f0f2f5;white-space:normal;vertical-align:bottom}
tr.paper td{background:#f7f8fa}figure{margin:.75rem 0}img{width:100%;height:auto;border:1px solid #e3e6ea}
figcaption{font-size:.88rem;color:#454c55}figcaption code{white-space:normal}
@media(max-width:40rem){body{padding:.6rem}th,td{white-space:normal;padding:.25rem .3rem}table{font-size:.75rem}ul{padding-left:1.1rem}}"""


def words(text):
    text = escape.escape(str(text), quote=False)
    text = re.sub(r"`([^`]+)`", r"<code>\1</code>", text)
    return re.sub(r"\*\*([^*]+)\*\*", r"<strong>\1</strong>", text)


def markdown(blocks, folder):
    """figures: FOLDER/NAME.svg."""
    def one(kind, *of):
        if kind == "h2":
            return f"## {of[0]}"
        if kind == "ul":
            return "\n".join(f"- {item}" for item in of[0])
        if kind == "table":
            return rows(*of)
        if kind == "figure":
            name, alt, caption, command = of
            return f"![{alt}]({folder}/{name}.svg)\n\n{caption} (`{command}`)"
        return of[0]
    return "\n\n".join(one(*block) for block in blocks)


def html(title, blocks, svgs):
    """svgs: {name: text}. The first heading and what is under it are set apart."""
    def table(header, lines):
        body = "".join(f"<tr{' class=paper' if ': paper**' in str(line[0]) else ''}>" + "".join(f"<td>{words(c)}</td>" for c in line) + "</tr>\n" for line in lines)
        return f"<div class=wide><table>\n<tr>{''.join(f'<th>{words(c)}</th>' for c in header)}</tr>\n{body}</table></div>"

    def figure(name, alt, caption, command):
        data = base64.b64encode(svgs[name].encode()).decode()
        return (f'<figure><img alt="{escape.escape(alt)}" src="data:image/svg+xml;base64,{data}">'
                f"<figcaption>{words(caption)} (<code>{escape.escape(command)}</code>)</figcaption></figure>")

    def one(kind, *of):
        if kind == "ul":
            return "<ul>\n" + "\n".join(f"<li>{words(item)}</li>" for item in of[0]) + "\n</ul>"
        return {"table": table, "figure": figure}[kind](*of) if kind in ("table", "figure") else f"<{kind}>{words(of[0])}</{kind}>"

    parts, heads = ["<div class=first>"], 0
    for block in blocks:
        heads += block[0] == "h2"
        if block[0] == "h2" and heads == 2:
            parts.append("</div>")
        parts.append(one(*block))
    body = "\n".join(parts)
    return ("<!doctype html>\n<!-- SPDX-License-Identifier: Apache-2.0 -->\n"
            f'<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{words(title)}</title>\n<style>\n{STYLE}\n</style></head>\n<body>\n<h1>{words(title)}</h1>\n"
            "<p>Written by <code>toolchain/campaign paper</code>. Which code it is of, and whether that has changed since, is in "
            "<code>docs/measured/paper.md</code>.</p>\n"
            f"{body}\n</body></html>\n")
