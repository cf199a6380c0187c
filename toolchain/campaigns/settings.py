# SPDX-License-Identifier: Apache-2.0
"""The estimator's figures that are missed on the logs, and the best that any setting reaches there: each number of the filter, of
its stances and of its slips, three times as large and a third of it, one at a time."""
import math
import pathlib
import subprocess
import tempfile

from campaigns import log_variants
from campaigns.engine import Page, Table, rows
from campaigns.estimation import CASSIE, COMPARED, FIGURES, GAZEBO, WALK, bound_text, logs_found, scores

SECTIONS = ("estimator.motion", "estimator.filter", "estimator.filter.stance")
FACTORS = (1 / 3, 3)
# log -> (figure, least, most), as issue and estimation.asked() have them.
ASKED = {WALK: (("position_rmse_mm", 0, 13), ("drift_percent", 0, 3), ("tilt_rmse_deg", 0, 0.62)),
         GAZEBO: (("position_rmse_mm", 0, 45), ("drift_percent", 0, 1.2)),
         CASSIE: (("position_rmse_mm", 0, 5), ("velocity_rmse_mmps", 0, 8.5))}
HONEST = (("nees_in_bounds_percent", 85, math.inf), ("nees_mean", 3, 10), ("planted_foot_mm", 0, 5))
CHANGE = "greatest change, %"
NAMES = {key: name for name, (key, _) in FIGURES.items()}


def numbers(tool):
    """(section, name, value) of each number of the sections."""
    listed = subprocess.run([tool, "params", "list"], capture_output=True, text=True, check=True).stdout
    section = ""
    for line in listed.splitlines():
        if line.startswith("["):
            section = line.strip("[]")
        elif section in SECTIONS and " = " in line:
            name, value = line.split("#")[0].split(" = ")
            if value.strip() not in ("true", "false"):
                yield section, name, float(value)


def measured(tool, folder, thinned, change):
    """{(log, figure): value} with one number changed, None where the program refuses it."""
    command = [tool, "estimate"]
    if change:
        section, name, value = change
        file = pathlib.Path(folder, "params.toml")
        file.write_text(f"[{section}]\n{name} = {value!r}\n")
        command += ["--params", file]
    found = {}
    for (log, variant), path in thinned.items():
        s = scores(command, path)
        if isinstance(s, str):
            return None
        found[log, variant] = s
    out = {}
    for log in ASKED:
        own = found[log, "as it is"]
        for key, *_ in (*ASKED[log], *HONEST):
            out[log, key] = own[key]
        for variant in log_variants.THINNED[1:]:
            keys = [FIGURES[figure][0] for figure in COMPARED if own[FIGURES[figure][0]]]
            out[log, variant] = max(abs(100 * (found[log, variant][key] / own[key] - 1)) for key in keys)
    return out


def bars():
    """{(log, figure): (least, most)}"""
    out = {(log, key): (least, most) for log in ASKED for key, least, most in (*ASKED[log], *HONEST)}
    return out | {(log, variant): (0, 15) for log in ASKED for variant in log_variants.THINNED[1:]}


def shortfall(value, bar):
    """0 where it holds, or is not told by the log."""
    least, most = bar
    return 0 if value is None else max(least - value, value - most, 0)


def settings(engine, _):
    logs = logs_found()
    if not all(log in logs for log in ASKED):
        return None
    with tempfile.TemporaryDirectory() as folder:
        thinned = {}
        for i, log in enumerate(ASKED):
            for k, variant in enumerate(log_variants.THINNED):
                thinned[log, variant] = pathlib.Path(folder, f"{i}_{k}.csv")
                log_variants.write(thinned[log, variant], log_variants.VARIANTS[variant](log_variants.read(logs[log])))
        tried = {"as it is": measured(engine.tool, folder, thinned, None)}
        for section, name, value in list(numbers(engine.tool)):
            for factor in FACTORS:
                own = f"`{section.removeprefix('estimator.')}.{name}` {'x 3' if factor > 1 else '/ 3'}"
                tried[own] = measured(engine.tool, folder, thinned, (section, name, value * factor)) if value else None
    refused = sum(found is None for found in tried.values())
    tried = {own: found for own, found in tried.items() if found is not None}
    held, ours = bars(), tried["as it is"]
    lines = []
    for place, bar in held.items():
        if shortfall(ours[place], bar) == 0:
            continue
        best = min(tried, key=lambda own: shortfall(tried[own][place], bar))
        lost = [f"{log.split(',')[0]}: {NAMES.get(key, key)}" for (log, key), other in held.items()
                if shortfall(tried[best][log, key], other) > 0 and shortfall(ours[log, key], other) == 0]
        lines.append((place[0], NAMES.get(place[1], f"{place[1]}: {CHANGE}"), bound_text(*bar), f"{ours[place]:.2f}", f"{tried[best][place]:.2f}",
                      best, "; ".join(lost) or "none"))
    return Page(
        f"Each of {len(tried) - 1} settings is one number of `{'`, `'.join(SECTIONS)}`, three times as large or a third of it, on all logs and on every 2nd and every "
        f"5th row of them; {refused} more are 0 or were refused as out of range. For each figure that the shipped setting misses, the best of "
        "them, and what it loses: figures that are held now and would be missed. The filters beside ours are in [estimation](estimation.md).\n\n" +
        rows(("log", "figure", "asked", "shipped", "best of all", "with", "it loses"), lines), {})


TABLES = {"estimation-settings": Table("The estimator's missed figures, and the best that other settings reach", (0,), settings, 3,
                                       ("toolchain/campaigns/estimation.py", "toolchain/campaigns/log_variants.py"))}
