# SPDX-License-Identifier: Apache-2.0
"""Runs what a table needs, some at a time, each only once for the same code."""
import ast
import concurrent.futures
import dataclasses
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
CODE = ("algorithms", "hal", "scheduler", "firmware", "sim_stub", "CMakeLists.txt", "CMakePresets.json")
BESIDE = "firmware/daemon"  # runs on the robot alone: no table is measured with it
HASHED = (".hpp", ".cpp", ".h", ".in", ".toml", ".py", ".json", ".txt")  # and files that are named themselves
COMMENT = re.compile(r'//[^\n]*|/\*.*?\*/|("(?:\\.|[^"\\\n])*")', re.S)


def meant(path):
    """A file without what changes no result: comments and white space."""
    text = path.read_text(errors="replace")
    if path.suffix in (".hpp", ".cpp", ".h", ".in"):
        text = COMMENT.sub(lambda m: m[1] or " ", text)
    elif path.suffix == ".py" or text.startswith("#!/usr/bin/env python3"):
        return ast.dump(ast.parse(text))
    elif path.suffix in (".txt", ".toml"):
        text = re.sub(r"^\s*#[^\n]*", "", text, flags=re.M)
    return " ".join(text.split())


def code_hash(root=ROOT, inputs=()):
    """Of the module, the simulation, how they are compiled and further inputs: files, or folders of files."""
    digest = hashlib.sha256()
    paths = set()
    for top in (*CODE, *inputs):
        place = root / top
        paths |= {place} if place.is_file() else {p for p in place.rglob("*") if p.suffix in HASHED and p.is_file()}
    for path in sorted(paths):
        if path.is_relative_to(root / BESIDE):
            continue
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + meant(path).encode() + b"\0")
    return digest.hexdigest()[:16]


@dataclasses.dataclass
class Figure:
    """A number of README's table as it is shown, and what it is held to: at "most" or at "least" so much."""
    value: float
    text: str
    at: str = ""
    asked: object = None
    asked_text: object = None  # where it is not the number

    def row(self):
        bound = self.asked_text or ("-" if self.asked is None else f"{self.asked:g}")
        return {"value": self.value, "measured": self.text, "at": self.at, "asked": self.asked, "bound": bound}


def headline(what, figures, unit="", shown=True):
    """One line of README's table, of one figure or a list. One that is not shown is held to its bound all the same."""
    figures = figures if isinstance(figures, list) else [figures]
    return {"what": what, "figures": [figure.row() for figure in figures], "unit": unit, "shown": shown}


@dataclasses.dataclass
class Page:
    text: str       # Markdown, without the title
    headline: dict  # name -> headline(): lines of README's table
    files: dict = dataclasses.field(default_factory=dict)  # path from the root -> text: written beside the page


@dataclasses.dataclass
class Table:
    title: str
    seeds: object
    measure: object  # (engine, seeds) -> Page, or None where its inputs are missing
    minutes: int = 1  # on two idle cores, to tell how long
    inputs: tuple = ()  # what it depends on besides CODE and its own script

    def hash(self, root=ROOT):
        own = (f"toolchain/{self.measure.__module__.replace('.', '/')}.py", "toolchain/campaigns/engine.py")
        return code_hash(root, (*own, *self.inputs))


def build(*targets):
    """Programs of the preset release, while nobody else builds in its folder."""
    words = ["bash", "-c", 'source toolchain/lib.sh && build release "$@"', "campaign", *targets]
    done = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        raise SystemExit(f"campaign: {', '.join(targets)}: not built: {done.stdout[-400:]}")


def told(arguments):
    """What the tool is told: by the data sheet, where a table does not say otherwise."""
    words = [str(a) for a in arguments]
    return words if "--reality" in words else ["--reality", "0", *words]


class Engine:
    def __init__(self, tool, jobs, peer=None):
        """peer: where invariant-ekf's sources are, if anywhere."""
        self.tool, self.jobs, self.peer = pathlib.Path(tool), jobs, peer
        if not self.tool.exists():
            sys.exit(f"campaign: there is no tool {self.tool}")
        self.code = hashlib.sha256(self.tool.read_bytes()).hexdigest()[:16]
        self.kept = ROOT / "build/campaign" / self.code
        self.kept.mkdir(parents=True, exist_ok=True)

    def climb(self, arguments, timeout_s=900):
        """The summary of one climb; {} with the tool's own sentence under "reason" where it wrote none."""
        arguments = told(arguments)
        key = hashlib.sha256("\0".join(arguments).encode()).hexdigest()[:24]
        kept = self.kept / f"{key}.json"
        if kept.exists():
            return json.loads(kept.read_text())
        with tempfile.TemporaryDirectory() as out:
            done = subprocess.run([self.tool, "climb", *arguments, "--record", "none", "--out", out], capture_output=True, text=True,
                                  timeout=timeout_s, start_new_session=True)  # Ctrl-C is for the campaign alone
            written = pathlib.Path(out, "summary.json")
            summary = json.loads(written.read_text()) if written.exists() else {}
        if not summary:
            summary = {"verdict": "none", "reason": (done.stderr or done.stdout).strip()[-300:], "exit": done.returncode}
        summary["run"] = " ".join(arguments)
        if summary["verdict"] not in ("pass", "fail"):  # crashed, or interrupted from outside: no result to keep
            return summary
        partial = kept.with_suffix(".part")
        partial.write_text(json.dumps(summary))
        partial.rename(kept)
        return summary

    def picture(self, arguments):
        """The drawing of one climb (SVG)."""
        with tempfile.TemporaryDirectory() as out:
            subprocess.run([self.tool, "climb", *told(arguments), "--record", "none", "--out", out], check=True, capture_output=True, start_new_session=True)
            return pathlib.Path(out, "climb.svg").read_text()

    def climbs(self, what, all_arguments):
        """The summaries, in the order asked for; says how far it is."""
        all_arguments = [list(a) for a in all_arguments]
        done = 0
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            futures = [pool.submit(self.climb, a) for a in all_arguments]
            try:
                for _ in concurrent.futures.as_completed(futures):
                    done += 1
                    print(f"\r{what}: {done} of {len(futures)}", end="", file=sys.stderr, flush=True)
            except KeyboardInterrupt:
                for future in futures:
                    future.cancel()
                raise
        print(file=sys.stderr)
        return [f.result() for f in futures]


def commit():
    """The code's: pages that a campaign has just written do not count."""
    def git(*words):
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True).stdout.strip()
    at = git("rev-parse", "--short=10", "HEAD")
    return at + ("-dirty" if git("status", "--porcelain", "--", *CODE) else "") if at else "no repository"


def rows(header, lines):
    """A Markdown table."""
    out = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(out + ["| " + " | ".join(str(c) for c in line) + " |" for line in lines])
