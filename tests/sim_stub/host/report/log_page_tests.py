# SPDX-License-Identifier: Apache-2.0
"""What the page of a replayed log promises; page_test.py runs these with its own. The log is made up."""
import json

import numpy as np

from chromium import Failed
from sample_report import block

T_S = np.arange(0, 20, 0.02)
SPIKE_MM = 87.0


def chart(group, title, unit, lines):
    table = np.stack([T_S, *(values for _, _, values in lines)], -1)
    return {"group": group, "title": title, "unit": unit, "digits": 2, "lines": [{"label": label, "look": look} for label, look, _ in lines],
            "table": block(table, "i32", 1e-3, delta=True)}


def log(variant):
    wave = np.sin(T_S)
    error = 5 * wave
    error[500] = SPIKE_MM
    sigma = 10 + T_S
    lio = np.where(np.arange(len(T_S)) % 5 == 0, error + 3, np.nan)
    truth = variant != "no_truth"
    charts = [chart("value", "Position x", "m", ([("truth", "truth", wave)] if truth else []) + [("estimate", "estimate", wave + 0.01)]),
              chart("innovation", "Squared innovations over their variances", "", [("foot position", "first", np.abs(wave))])]
    if truth:
        charts = [chart("error", f"Position {axis}", "mm", [("+3σ", "high", sigma), ("−3σ", "low", -sigma), ("LIO, raw", "lio", lio), ("estimate", "estimate", error)]) for axis in "xyz"] + charts
    else:
        charts.append(chart("sigma", "3σ of the position", "mm", [("x", "first", sigma)]))
    summary = {"params_hash": "0123456789abcdef", "rows": len(T_S), "duration_s": 20.0, "start": "standstill", "warnings": ["<b>a doubt</b>"],
               "gyro_bias_radps": [0, 0, 0.001], "accel_bias_mps2": [0, 0, 0.01], "innovations": {"foot_position": {"updates": 900, "mean": 1.1, "last_second": 0.9}},
               "innovation_outliers": 3, "moving_contact_rows": 4, "rows_without_contact_percent": 0.0, "gaps": 1, "imu_invalid": 0,
               "final_position_sigma_mm": [1, 2, 3], "final_yaw_sigma_deg": 0.4, "lio": {"poses": 200, "accepted": 198, "jump": 2, "not_arrived": 0, "age_at_end_s": 0.1}}
    if truth:
        summary |= {"position_rmse_mm": 12.34, "velocity_rmse_mmps": 3.0, "attitude_rmse_deg": 0.5, "drift_percent": 1.25, "distance_m": 8.0, "nees_in_bounds_percent": 91.5}
    return {"format": "polygmap-log", "version": 1, "name": "</script>walk.csv", "start_s": 0, "duration_s": 20.0, "has_truth": truth, "has_lio": True, "has_soles": True,
            "summary": summary, "contacts": {foot: [[float(t), "stands" if (i + k) % 2 else "swings"] for i, t in enumerate(range(0, 20, 2))] for k, foot in enumerate(("left", "right"))},
            "events": [] if variant == "quiet" else [{"kind": "LIO refused", "t_s": 7.5, "duration_s": 0, "count": 2, "text": "too far from the odometry"}],
            "charts": charts}


def page_of(pages, variant):
    return pages.raw(f"log_{variant}", json.dumps(log(variant)).replace("<", "\\u003c"))


def check(condition, sentence):
    if not condition:
        raise Failed(sentence)


SCROLLED = "(async () => { for (let y = 0; y < document.body.scrollHeight; y += 400) { scrollTo(0, y); await new Promise((r) => setTimeout(r, 60)); } })()"


def Log_AnyVariant_ComplainsOfNothingAndFitsAPhone(browser, pages):
    for variant in ("full", "no_truth", "quiet"):
        for phone in (False, True):
            page = browser.open(page_of(pages, variant), dark=phone, mobile=phone, **({"width": 390, "height": 844} if phone else {}))
            page.run(SCROLLED)
            complaints = page.complaints()
            check(not complaints, f"{variant}: the console has: {'; '.join(complaints)[:400]}")
            width = page.run("document.documentElement.scrollWidth")
            check(not phone or width <= 390, f"{variant}: the page is {width} px wide on a phone of 390 px")
            page.close()
    return "3 kinds of data"


def Log_Opened_HasScoresAndDrawsEveryCurve(browser, pages):
    page = browser.open(page_of(pages, "full"), width=1280, height=2000)
    page.run(SCROLLED)
    check("12.3 mm" in page.run("document.querySelector('#scores').innerText"), "the score of the position is not in the table")
    drawn = page.run("[...document.querySelectorAll('#time .chart canvas')].map((c) => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; const seen = new Set(); for (let i = 0; i < d.length; i += 4) seen.add(d[i] << 16 | d[i + 1] << 8 | d[i + 2]); return seen.size; })")
    check(len(drawn) == 5 and min(drawn) > 5, f"the charts have so many colours: {drawn}")
    header = page.run("document.querySelector('header').innerText")
    check("</script>walk.csv" in header and "<b>a doubt</b>" in header, "name and warning are not shown as they are")
    page.close()
    return f"{len(drawn)} charts"


def Log_AtASpike_ReadsItOut(browser, pages):
    page = browser.open(page_of(pages, "full"), width=1280, height=2000)
    page.run(f"window.polygmap.seek({T_S[500]})")
    page.run("new Promise((done) => setTimeout(done, 300))")
    said = page.run("[...document.querySelectorAll('#time .chart')][0].querySelector('.legend').innerText.replace(/\\s+/g, ' ')")
    check(f"estimate {SPIKE_MM:.2f}" in said, f"at the spike the chart says '{said}'")
    page.key("Home")
    page.key("ArrowRight", shift=True)
    at = page.run("new Promise((done) => setTimeout(() => done(window.polygmap.state().t_s), 60))")
    check(abs(at - 1) < 1e-6, f"home and the right arrow with shift lead to {at} s")
    page.close()
    return None


def Log_Refusals_StandOnTheTimeAxis(browser, pages):
    page = browser.open(page_of(pages, "full"))
    page.run("window.polygmap.seek(7.5)")
    page.run("document.querySelector('.strip').scrollIntoView()")
    page.run("new Promise((done) => setTimeout(done, 300))")
    said = page.run("[...document.querySelectorAll('.strip')].map((s) => s.innerText).join('; ')")
    check("2 × too far from the odometry at 7.50 s" in said and "stands" in said, f"the strips say '{said}'")
    page.close()
    page = browser.open(page_of(pages, "quiet"))
    check("Nothing was bridged" in page.run("document.querySelector('#time').innerText"), "that nothing was refused is not said")
    page.close()
    return None


def Log_WithoutTruth_SaysSo(browser, pages):
    page = browser.open(page_of(pages, "no_truth"))
    check(page.run("(() => { const e = document.querySelector('#no-truth'); return !!e && e.checkVisibility() && e.textContent.includes('no truth'); })()"), "a log without truth does not say so")
    check("RMSE" not in page.run("document.body.innerText"), "scores are shown without truth")
    page.close()
    return None


TESTS = {f.__name__: f for f in (Log_AnyVariant_ComplainsOfNothingAndFitsAPhone, Log_Opened_HasScoresAndDrawsEveryCurve, Log_AtASpike_ReadsItOut,
                                 Log_Refusals_StandOnTheTimeAxis, Log_WithoutTruth_SaysSo)}
