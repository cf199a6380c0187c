#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""page_test [--page TEMPLATE] [--inject FILE] [TEST...]: opens the report's page in a headless Chromium, with the data of
made-up climbs, and checks what the page promises. --inject puts a piece of HTML at each page's end: that is how every test is
shown to fail (toolchain/checks/seeded/report_page). Skipped, with status 77, where there is no Chromium."""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

import frame_page_tests
import log_page_tests
import sample_report
from chromium import Chromium, Failed, program

FIRST_FRAME_CPU_S = 2.0
MOST_BYTES = 4_000_000
NEAR_M = 0.001
TESTS = {}


def test(function):
    TESTS[function.__name__] = function
    return function


class Pages:
    """The page files of all variants, made when they are first asked for."""

    def __init__(self, folder, template, inject):
        self.folder, self.template, self.inject = pathlib.Path(folder), template, inject

    def path(self, variant):
        file = self.folder / f"{variant}.html"
        return file if file.exists() else self.raw(variant, sample_report.text_of(sample_report.data_of(variant)))

    def raw(self, name, data):
        """The page with that text in it."""
        file = self.folder / f"{name}.html"
        text = self.template.replace("@POLYGMAP_DATA@", data)
        fill = re.sub(r"@FILL (\d+)@", lambda m: "." * int(m[1]), self.inject)
        file.write_text(text.replace("</body>", fill + "</body>"))
        return file


# What the page says is missing, of elements that are not hidden.
SHOWN = "[...document.querySelectorAll('.missing, #time > .group > .note')].filter((e) => e.checkVisibility() && e.textContent.length > 20).map((e) => e.textContent)"


def check(condition, sentence):
    if not condition:
        raise Failed(sentence)


def interpolated(motion, table, t):
    return np.array([np.interp(t, motion.t, table[:, c]) for c in range(3)])


@test
def Page_AllOfItScrolled_ComplainsOfNothing(browser, pages):
    for variant in ("full", "fallen", "no_truth", "no_pictures", "gaps", "bare", "empty", "two"):
        for dark in (False, True) if variant == "full" else (False,):
            page = browser.open(pages.path(variant), dark=dark)
            page.run("(async () => { for (let y = 0; y < document.body.scrollHeight; y += 400) { scrollTo(0, y); await new Promise((r) => setTimeout(r, 60)); } })()")
            page.run("window.polygmap?.seek(window.polygmap.duration_s / 2)")
            complaints = page.complaints()
            check(not complaints, f"{variant}: the console has: {'; '.join(complaints)[:400]}")
            page.close()
    return "8 kinds of data"


@test
def Seek_AnyTime_PutsTheRobotWhereTheLogHasIt(browser, pages):
    _, motion = sample_report.made_up_run()
    page = browser.open(pages.path("full"))
    worst = 0.0
    check(abs(page.run("window.polygmap.duration_s") - motion.t[-1]) < 1e-6, "duration_s is not the run's")
    for t in (0.0, 0.4567, 3.21, 7.003, 7.2, 9.9999, 12.5, float(motion.t[-1])):
        page.run(f"window.polygmap.seek({t})")
        state = page.run("window.polygmap.state()")
        check(abs(state["t_s"] - t) < 1e-6, f"after seek({t}) the page is at {state['t_s']}")
        for name, got, table in (("base", state["base"], motion.base), ("left foot", state["feet"][0], motion.soles[0]), ("right foot", state["feet"][1], motion.soles[1])):
            off = float(np.linalg.norm(np.array(got) - interpolated(motion, table, t)))
            worst = max(worst, off)
            check(off <= NEAR_M, f"at {t} s the {name} is {off * 1e3:.2f} mm from where the log has it")
    page.close()
    return f"worst {worst * 1e3:.3f} mm"


@test
def Drawing_AnyTime_HasTheFootWhereTheLogHasIt(browser, pages):
    """What is drawn, not what state() says: the drawing's coordinates are metres."""
    _, motion = sample_report.made_up_run()
    page = browser.open(pages.path("full").as_posix() + "", fragment="?svg")
    for t in (2.0, 7.2, 11.3):
        page.run(f"window.polygmap.seek({t})")
        for foot, name in enumerate(("left", "right")):
            corner = page.run(f"document.querySelector('.side .foot.{name}').getAttribute('d').match(/M([-\\d.]+) ([-\\d.]+)/).slice(1).map(Number)")
            p = interpolated(motion, motion.soles[foot], t)
            off = np.hypot(corner[0] - (p[0] + 0.049 - 0.13), -corner[1] - p[2])
            check(off <= NEAR_M, f"at {t} s the {name} foot is drawn {off * 1e3:.2f} mm from where the log has it")
    page.close()
    return "3 times"


@test
def Pictures_OfTwoTimes_Differ(browser, pages):
    page = browser.open(pages.path("full"))
    seen, scenes = [], []
    for t in (1.0, 8.0):
        page.run(f"window.polygmap.seek({t})")
        page.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))")
        seen.append(page.run("document.querySelector('#picture canvas').toDataURL()"))
        box = page.run("(() => { const r = document.querySelector('#stage .canvas').getBoundingClientRect(); return { x: r.x, y: r.y, width: r.width, height: r.height, scale: 1 }; })()")
        scenes.append(page.call("Page.captureScreenshot", format="png", clip=box)["data"])
    check(seen[0] != seen[1], "the depth picture is the same at two times")
    check(scenes[0] != scenes[1], "the scene is the same at two times")
    page.close()
    return None


@test
def Phone_AnyVariant_DoesNotScrollSideways(browser, pages):
    for variant in ("full", "ten", "stopped", "bare", "two"):
        page = browser.open(pages.path(variant), width=390, height=844, mobile=True)
        page.run("(async () => { for (let y = 0; y < document.body.scrollHeight; y += 600) { scrollTo(0, y); await new Promise((r) => setTimeout(r, 40)); } })()")
        width = page.run("document.documentElement.scrollWidth")
        check(width <= 390, f"{variant}: the page is {width} px wide on a phone of 390 px")
        page.close()
    return None


@test
def Address_WithATime_OpensThere(browser, pages):
    page = browser.open(pages.path("full"), fragment="#t=5.25")
    at = page.run("window.polygmap.state().t_s")
    check(abs(at - 5.25) < 1e-6, f"#t=5.25 opens at {at}")
    page.run("location.hash = '#t=2.5'; new Promise((done) => setTimeout(done, 100))")
    at = page.run("window.polygmap.state().t_s")
    check(abs(at - 2.5) < 1e-6, f"a new #t=2.5 leaves the page at {at}")
    page.close()
    return None


@test
def FailedClimb_Opened_IsAtTheMomentItFailed(browser, pages):
    for variant, moment, why in (("stopped", 9.0, "too vaguely"), ("fallen", 10.02, "fell")):
        page = browser.open(pages.path(variant))
        at = page.run("window.polygmap.state().t_s")
        check(abs(at - moment) < 0.01, f"{variant}: the page opens at {at} s, and it failed at {moment} s")
        head = page.run("document.querySelector('header').innerText")
        check(why in head, f"{variant}: the head does not say why it failed")
        page.close()
    page = browser.open(pages.path("stopped"), fragment="#t=1")
    check(abs(page.run("window.polygmap.state().t_s") - 1) < 1e-6, "#t= does not go before the failure")
    page.close()
    return None


@test
def NoTruth_Opened_ShowsTheModulesWorldAndSaysSo(browser, pages):
    _, motion = sample_report.made_up_run()
    page = browser.open(pages.path("no_truth"), fragment="#t=6")
    base = page.run("window.polygmap.state().base")
    off = np.linalg.norm(np.array(base) - interpolated(motion, motion.base, 6.0))
    check(1e-4 < off < 0.02, f"the base is {off * 1e3:.2f} mm from the truth, which the file does not have")
    check(page.run(SHOWN + ".some((text) => text.includes('has no truth'))"), "the page does not say that truth is missing")
    page.close()
    return None


@test
def MissingParts_Opened_AreNamed(browser, pages):
    page = browser.open(pages.path("no_pictures"))
    check("without pictures" in page.run("document.querySelector('#picture').innerText"), "the page does not say that pictures are missing")
    page.close()
    page = browser.open(pages.path("bare"))
    said = page.run(SHOWN + ".length")
    check(said >= 12, f"of a file with nothing in it only {said} parts are said to be missing")
    page.close()
    page = browser.open(pages.path("empty"))
    check("no run" in page.run("document.body.innerText"), "a report without a run does not say so")
    page.close()
    return f"{said} parts"


@test
def BrokenData_Opened_SayWhatIsWrong(browser, pages):
    """One sentence in the page, and no more than that."""
    good = sample_report.text_of(sample_report.data_of("full"))
    cases = {"cut": (good[:5000], "cannot be read"), "stranger": ('{"format":"other"}', "not a PolygMap report"),
             "newer": (good.replace('"version":1', '"version":2'), "version 2"), "short": (re.sub(r'"count":(\d+)', lambda m: f'"count":{int(m[1]) + 1}', good, count=1), "bytes and not"),
             "packed": (re.sub(r'("zlib":true,"data":")....', r"\1AAAA", good, count=1), "cannot be read"),
             "clock": (good.replace('"clock":"motion"', '"clock":"gone"'), 'the clock "gone"')}
    for name, (text, said) in cases.items():
        check(name in ("cut", "stranger") or text != good, f"{name}: the data were not broken, so this proves nothing")
        page = browser.open(pages.raw(name, text))
        check(said in page.run("document.body.innerText"), f"{name}: the page does not say what is wrong")
        check(not page.complaints(), f"{name}: the console has: {page.complaints()}")
        page.close()
    return f"{len(cases)} kinds"


@test
def Keys_Pressed_MoveTheTime(browser, pages):
    page = browser.open(pages.path("full"))
    at = lambda: page.run("new Promise((done) => setTimeout(() => done(window.polygmap.state().t_s), 60))")
    page.key("ArrowRight")
    check(abs(at() - 0.1) < 1e-6, "the right arrow does not go 0.1 s on")
    page.key("ArrowRight", shift=True)
    check(abs(at() - 1.1) < 1e-6, "the right arrow with shift does not go 1 s on")
    page.key("ArrowLeft")
    check(abs(at() - 1.0) < 1e-6, "the left arrow does not go 0.1 s back")
    page.key("End")
    check(abs(at() - page.run("window.polygmap.duration_s")) < 1e-6, "end does not go to the end")
    page.key("Home")
    check(at() == 0, "home does not go to the start")
    page.key(" ")
    page.wait("window.polygmap.state().t_s > 0.05", 20)
    page.key(" ")
    stopped = at()
    check(at() == stopped, "space does not pause")
    page.close()
    return None


@test
def ClosestList_OfAClimb_LeadsToTheMoment(browser, pages):
    run, _ = sample_report.made_up_run()
    least = min((s for s in run["steps"] if "sole_margin_mm" in s), key=lambda s: s["sole_margin_mm"])
    page = browser.open(pages.path("full"))
    row = page.run("(() => { const r = [...document.querySelectorAll('#closest tbody tr')].find((e) => e.innerText.includes('edge of its tread')); r.querySelector('button').click(); return r.innerText; })()")
    check(f"{least['sole_margin_mm']:.1f} mm" in row and least["foot"] in row, f"the least margin is not in the row '{row}'")
    at = page.run("new Promise((done) => setTimeout(() => done(window.polygmap.state().t_s), 100))")
    check(abs(at - least["touch_down_s"]) < 1e-6, f"its link leads to {at} s, and it was at {least['touch_down_s']} s")
    used = page.run("[...document.querySelectorAll('#closest .meter + *, #closest tbody td:nth-child(4)')].map((e) => parseFloat(e.innerText.replace('−', '-')))")
    check(used == sorted(used, reverse=True) and len(used) >= 6, f"the list is not ranked: {used}")
    page.close()
    return None


@test
def TwoRuns_Opened_ShowDifferencesFirst(browser, pages):
    page = browser.open(pages.path("two"))
    check(page.run("document.querySelector('main > *').id") == "differences", "the differences do not come first")
    said = page.run("document.querySelector('#differences').innerText")
    for word in ("steps_climbed", "verdict", "--seed 11"):
        check(word in said, f"the differences do not name {word}")
    check("plane_rate_hz" not in said, "a figure that is the same in both is among the differences")
    check(page.run("document.querySelectorAll('#overlaid .chart').length") >= 8, "the curves of both are not there")
    page.close()
    return None


@test
def LongRun_Opened_SeeksAnywhere(browser, pages):
    page = browser.open(pages.path("long"))
    page.run("window.polygmap.seek(900.5)")
    check(abs(page.run("window.polygmap.state().t_s") - 900.5) < 1e-6 and page.run("window.polygmap.state().base.every(Number.isFinite)"), "a run of 1000 s cannot be sought in")
    page.close()
    return None


@test
def TenSteps_AsAFile_StayWithin4Megabytes(browser, pages):
    size = pages.path("ten").stat().st_size
    check(size <= MOST_BYTES, f"ten steps make {size} bytes, more than {MOST_BYTES}")
    return f"{size / 1e6:.2f} MB"


@test
def FirstFrame_OfTenSteps_TakesNoMoreThan2SecondsOfCpu(browser, pages):
    """The least of three: what a machine's other work adds is not the page's."""
    took = []
    for _ in range(3):
        page = browser.open(pages.path("ten"))
        took.append(page.first_frame_cpu_s)
        page.close()
    check(min(took) <= FIRST_FRAME_CPU_S, f"the first frame takes {min(took):.2f} s of CPU")
    return f"{min(took):.2f} s of CPU"


NO_WEBGL = {}


def test_without_webgl(function):
    NO_WEBGL[function.__name__] = function
    return function


@test_without_webgl
def Drawing_WithoutWebGl_MovesWithTheSlider(browser, pages):
    page = browser.open(pages.path("full"))
    boxes = []
    for t in (1.0, 8.0):
        page.run(f"window.polygmap.seek({t})")
        check(page.run("!!document.querySelector('#stage svg .foot')"), "without WebGL nothing is drawn")
        boxes.append(page.run("document.querySelector('#stage svg').getAttribute('viewBox') + document.querySelector('#stage svg .foot').getAttribute('d')"))
    check(boxes[0] != boxes[1], "the drawing does not move with the slider")
    check("no WebGL" in page.run("document.querySelector('#stage').innerText"), "the page does not say that there is no WebGL")
    check(not page.complaints(), f"the console has: {page.complaints()}")
    page.close()
    return None


TESTS |= frame_page_tests.TESTS | log_page_tests.TESTS
NO_WEBGL |= frame_page_tests.NO_WEBGL


def in_two_browsers(tests, options):
    """Half of them each, at once: a page is drawn by one core, mostly."""
    runs = [subprocess.Popen([sys.executable, __file__, *options, *tests[half::2]], stdout=subprocess.PIPE, text=True) for half in (0, 1)]
    outputs = [run.communicate()[0] for run in runs]
    lines = [line for output in outputs for line in output.splitlines() if not line.startswith("report_page: ")]
    failed = sum(line.startswith("FAIL") for line in lines)
    done = failed + sum(line.startswith("ok ") for line in lines)
    print(*lines, f"report_page: {done} tests, {failed} failed", sep="\n")
    return 1 if failed or done != len(tests) or any(run.returncode not in (0, 1) for run in runs) else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", default=str(sample_report.TEMPLATE))
    parser.add_argument("--inject", help="a file with HTML for the end of each page")
    parser.add_argument("tests", nargs="*")
    arguments = parser.parse_args()
    unknown = set(arguments.tests) - set(TESTS) - set(NO_WEBGL)
    if unknown:
        parser.error(f"there is no test {', '.join(unknown)}; there are {', '.join([*TESTS, *NO_WEBGL])}")
    if not program():
        print("report_page: skipped, since there is no Chromium (apt-get install chromium)")
        return 77
    if not arguments.tests:
        return in_two_browsers([*TESTS, *NO_WEBGL], sys.argv[1:])
    inject = pathlib.Path(arguments.inject).read_text() if arguments.inject else ""
    count = failed = 0
    with tempfile.TemporaryDirectory() as folder:
        pages = Pages(folder, pathlib.Path(arguments.page).read_text(), inject)
        for webgl, tests in ((True, TESTS), (False, NO_WEBGL)):
            chosen = {n: f for n, f in tests.items() if n in arguments.tests}
            if not chosen:
                continue
            with Chromium(webgl) as browser:
                for name, function in chosen.items():
                    count += 1
                    try:
                        note = function(browser, pages)
                        print(f"ok   {name}{f': {note}' if note else ''}", flush=True)
                    except Failed as reason:
                        failed += 1
                        print(f"FAIL {name}: {reason}", flush=True)
    print(f"report_page: {count} tests, {failed} failed")
    return 1 if failed or not count else 0


if __name__ == "__main__":
    sys.exit(main())
