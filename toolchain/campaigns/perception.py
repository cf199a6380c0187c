# SPDX-License-Identifier: Apache-2.0
"""Tables of plane extraction, on generated frames with truth and on public ones."""
import json
import os
import pathlib
import re
import subprocess
import tempfile

from campaigns.engine import ROOT, Page, Table, build, rows

SHOWN = ("precision", "recall_treads", "recall_risers", "over_segmentation", "under_segmentation", "tread_angle_p95", "tread_offset_p95",
         "nosing_line_p95", "beyond_nosing_line_max", "columns_2px_beyond_max")


def planes(engine, seeds):
    done = subprocess.run([ROOT / "toolchain/checks/perceive", engine.tool, *map(str, seeds)], capture_output=True, text=True)
    if "sets and" not in done.stdout:
        return None
    sets = [(m[1], dict(p.split("=") for p in m[2].split())) for m in re.finditer(r"^-- (\w+ \w+) seed \d+: (.*)$", done.stdout, re.M)]
    names = sorted({n for n, _ in sets})
    shown = [f for f in (*SHOWN, "foreign_share", "foreign_worst", "covered_share", "covered_least") if f in sets[0][1]]
    least = ("precision", "recall_treads", "recall_risers", "covered_share", "covered_least")

    def worst(name, figure):
        values = [float(f[figure]) for n, f in sets if n == name and figure in f]
        return f"{(min if figure in least else max)(values):.3g}" if values else "-"

    missed = re.findall(r"^perceive: (.* error: .*)$", done.stdout, re.M)
    real = re.findall(r"^-- (\w+): (\d+ of \d+) planes, (\d+) detections$", done.stdout, re.M)
    text = (f"Sixteen scenes for each camera, noise and seed ({', '.join(map(str, seeds))}); worst seed of each. Angles in degrees, offsets and "
            "lines in mm.\n\n" + rows(("figure", *names), [(f, *(worst(n, f) for n in names)) for f in shown]) +
            "\n\nPublic frames against reference labels, which are no truth:\n\n" + rows(("frame", "planes found", "detections"), real) +
            ("\n\nMissed:\n\n" + "\n".join(f"- {m}" for m in missed) if missed else "\n\nNo bar is missed."))
    return Page(text, {})


PYTHON = "/usr/bin/python3"  # Debian's, which has Debian's numpy
ROUTE = ("recall_treads", "recall_risers", "precision", "over_segmentation", "tread_angle_p95", "tread_offset_p95", "nosing_lines",
         "nosing_line_median", "nosing_line_p95")


def route_instructions():
    """Of a frame through the module and through the paper's route, as recorded (tests/benchmarks)."""
    recorded = dict(line.split()[:2] for record in (ROOT / "tests/benchmarks").glob("*instructions.txt")
                    for line in record.read_text().splitlines() if line and line[0] not in "#" and len(line.split()) >= 2)
    return {"module": int(recorded["whole_frame"]), "paper": int(recorded["paper_route"])}


def paper_route(engine, seeds):
    """The same frames, gravity and scorer for all three."""
    tools = pathlib.Path(os.environ.get("POLYGMAP_SHARED_DATA", ROOT.parent / "shared/data")).parent / "tools"
    if not (tools / "stair_frames.py").exists():
        return None
    build("paper_route_frames")
    program = ROOT / "build/release/tests/paper_route_frames"
    routes = {"module": None, "paper's route, published parameters": "published", "paper's route, tuned here": "own"}
    lines = []
    for noise in ("white", "correlated"):
        for route, parameters in routes.items():
            good = frames_seen = 0
            totals = {}
            for seed in seeds:
                with tempfile.TemporaryDirectory() as scratch:
                    frames, results = f"{scratch}/frames", pathlib.Path(scratch, "results")
                    results.mkdir()
                    subprocess.run([PYTHON, tools / "stair_frames.py", frames, "--seed", str(seed), "--noise", noise], check=True)
                    for truth in sorted(pathlib.Path(frames).glob("s??.json")):
                        name = truth.stem
                        floor = next(p for p in json.loads(truth.read_text())["planes"] if p["kind"] == "floor")
                        camera, picture = truth.with_suffix(".camera.toml"), truth.with_suffix(".png")
                        labels, planes = results / f"{name}.labels.png", results / f"{name}.planes.json"
                        if parameters is None:
                            down = [str(-x) for x in floor["normal"]]
                            command = [engine.tool, "perceive", picture, "--camera", camera, "--gravity", *down, "--labels", labels, "--json", planes]
                        else:
                            command = [program, parameters, camera, *map(str, floor["normal"]), picture, labels, planes]
                        subprocess.run(command, check=True, capture_output=True)
                        good += every_plane_and_no_other(tools, frames, results, name, scratch)
                        frames_seen += 1
                    score = subprocess.run([PYTHON, tools / "score_planes.py", frames, results], check=True, capture_output=True, text=True).stdout
                    for key, value in (line.split() for line in score.splitlines()):
                        totals.setdefault(key, []).append(float(value))
            instructions = route_instructions()["module" if parameters is None else "paper"]
            lines.append((noise, route, *(f"{sum(totals[k]) / len(totals[k]):.2f}" for k in ROUTE), f"{30 * good / frames_seen:.1f}",
                          f"{instructions / 1e6:.1f} M" + (" (tuned)" if parameters == "published" else "")))
    return Page(f"Robot's camera, sixteen generated frames for each seed ({', '.join(map(str, seeds))}), means over seeds; every route is given the "
                "true gravity. Complete frames: those in which every plane of 1500 pixels was found and none was invented, of 30 a second (a climb's "
                "plane rate counts what is well in view: 3000 pixels, 60 mm both ways). A nosing of "
                "the paper's route is its polygon's near edge. Instructions are the records of tests/benchmarks; those of the route are with its "
                "parameters tuned here (5 iterations of diffusion, where 60 are published).\n\n" +
                rows(("noise", "route", *ROUTE, "complete frames Hz", "instructions"), lines), {})


def every_plane_and_no_other(tools, frames, results, name, scratch):
    """Whether this one frame has recall and precision 1."""
    one_frame, one_result = pathlib.Path(scratch, "one_frame"), pathlib.Path(scratch, "one_result")
    for folder, source in ((one_frame, pathlib.Path(frames)), (one_result, results)):
        folder.mkdir(exist_ok=True)
        for old in folder.iterdir():
            old.unlink()
        for path in source.glob(f"{name}.*"):
            (folder / path.name).symlink_to(path)
    score = subprocess.run([PYTHON, tools / "score_planes.py", one_frame, one_result], check=True, capture_output=True, text=True).stdout
    figures = dict(line.split() for line in score.splitlines())
    return float(figures["recall"]) == 1.0 and float(figures["precision"]) == 1.0


TABLES = {"paper-route": Table("The paper's own route beside the module's", (20260101, 1), paper_route, 3,
                              ("tests/reference/paper_route", "tests/benchmarks/instructions.txt",
                               "tests/benchmarks/reference_instructions.txt")),
          "planes": Table("Planes in single frames", (20260101, 1, 2), planes, 3,
                         ("toolchain/checks/perceive", "toolchain/checks/score_polygons.py"))}
