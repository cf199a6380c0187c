# SPDX-License-Identifier: Apache-2.0
"""What the page of a depth picture promises; page_test.py runs these with its own. The picture is of a made-up step."""
import base64
import io
import json

import numpy as np
from PIL import Image

from chromium import Failed
from sample_report import block

WIDTH, HEIGHT, FOCAL, STRIDE = 320, 240, 200.0, 2
PITCH_RAD = np.radians(50)
RISER_X_M, FLOOR_Z_M, TREAD_Z_M = 0.7, -1.0, -0.85
# Rows: the level axes x, y, z in the camera's (x right, y down, z ahead).
AXES = np.array([[0, -np.sin(PITCH_RAD), np.cos(PITCH_RAD)], [-1, 0, 0], [0, -np.cos(PITCH_RAD), -np.sin(PITCH_RAD)]])
SHEETS = [("tread", [(0, -0.4, FLOOR_Z_M), (RISER_X_M, -0.4, FLOOR_Z_M), (RISER_X_M, 0.4, FLOOR_Z_M), (0, 0.4, FLOOR_Z_M)], None),
          ("riser", [(RISER_X_M, -0.4, FLOOR_Z_M), (RISER_X_M, -0.4, TREAD_Z_M), (RISER_X_M, 0.4, TREAD_Z_M), (RISER_X_M, 0.4, FLOOR_Z_M)], None),
          ("tread", [(RISER_X_M, -0.4, TREAD_Z_M), (1.2, -0.4, TREAD_Z_M), (1.2, 0.4, TREAD_Z_M), (RISER_X_M, 0.4, TREAD_Z_M)], [(RISER_X_M, -0.4, TREAD_Z_M), (RISER_X_M, 0.4, TREAD_Z_M)])]


def camera_of(points):
    return (np.asarray(points) @ AXES).round(4).ravel().tolist()


def depths():
    """Depth and plane of every second column and row."""
    v, u = np.mgrid[0:HEIGHT:STRIDE, 0:WIDTH:STRIDE]
    rays = np.stack([(u - WIDTH / 2) / FOCAL, (v - HEIGHT / 2) / FOCAL, np.ones_like(u, float)], -1) @ AXES.T
    with np.errstate(divide="ignore"):
        candidates = np.stack([FLOOR_Z_M / rays[..., 2], RISER_X_M / rays[..., 0], TREAD_Z_M / rays[..., 2]], -1)
    at = rays[..., None, :] * candidates[..., None]
    fits = np.stack([at[..., 0, 0] <= RISER_X_M, (at[..., 1, 2] <= TREAD_Z_M), at[..., 2, 0] >= RISER_X_M], -1) & (candidates > 0)
    depth = np.where(fits, candidates, np.inf).min(-1)
    plane = np.where(fits, candidates, np.inf).argmin(-1) + 1
    seen = depth < 4
    return np.where(seen, depth, np.nan), np.where(seen, plane, 0)


def frame(variant):
    depth, plane = depths()
    picture = io.BytesIO()
    Image.fromarray((plane * 60).astype(np.uint8).repeat(2, 0).repeat(2, 1)).save(picture, "png")
    kinds = {"unknown": ["unknown"] * 3}.get(variant, [kind for kind, _, _ in SHEETS])
    planes = [{"id": i + 1, "kind": kinds[i], "normal": camera_of([(-1, 0, 0) if kind == "riser" else (0, 0, 1)]), "d_m": 0.9, "rmse_mm": 2.1,
               "sigma_offset_mm": 0.4, "sigma_angle_deg": 0.1,
               "pieces": [{"vertices": camera_of(corners), "area_m2": 0.3, "invalid_fraction": 0.02} | ({"nosing": camera_of(nosing)} if nosing else {})]}
              for i, (kind, corners, nosing) in enumerate(SHEETS)]
    if variant == "none":
        depth[:], planes = np.nan, []
    return {"format": "polygmap-frame", "version": 1, "name": "</script><b>step.png" if variant == "hostile" else "step.png",
            "camera": {"width_px": WIDTH, "height_px": HEIGHT, "fx_px": FOCAL, "fy_px": FOCAL, "cx_px": WIDTH / 2, "cy_px": HEIGHT / 2, "min_depth_m": 0.2, "max_depth_m": 4.0},
            "up": AXES[2].tolist(), "up_source": "assumed" if variant == "unknown" else "found", "in_range_share": 0.9, "params_hash": "0123456789abcdef",
            "warnings": ["<img src=x onerror=alert(1)> is no warning."] if variant == "hostile" else [],
            "cost": {"repeats": 3, "median_us": 812, "most_us": 900}, "planes": planes,
            "points": {"stride": STRIDE, "columns": WIDTH // STRIDE, "rows": HEIGHT // STRIDE,
                       "depth_and_plane": block(np.stack([depth.ravel(), plane.ravel()], -1), "i16", 0.0005, delta=True)},
            "picture": base64.b64encode(picture.getvalue()).decode()}


def page_of(pages, variant):
    return pages.raw(f"frame_{variant}", json.dumps(frame(variant)).replace("<", "\\u003c"))


def check(condition, sentence):
    if not condition:
        raise Failed(sentence)


NOSING = (240, 228, 66)
SCENE = "(() => { const r = document.querySelector('#stage .canvas').getBoundingClientRect(); return { x: r.x, y: r.y, width: r.width, height: r.height, scale: 1 }; })()"
SETTLED = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))"


def scene(page):
    page.run(SETTLED)
    return page.call("Page.captureScreenshot", format="png", clip=page.run(SCENE))["data"]


def Frame_AnyVariant_ComplainsOfNothingAndFitsAPhone(browser, pages):
    for variant in ("full", "none", "unknown", "hostile"):
        for phone in (False, True):
            page = browser.open(page_of(pages, variant), dark=phone, mobile=phone, **({"width": 390, "height": 844} if phone else {}))
            complaints = page.complaints()
            check(not complaints, f"{variant}: the console has: {'; '.join(complaints)[:400]}")
            width = page.run("document.documentElement.scrollWidth")
            check(not phone or width <= 390, f"{variant}: the page is {width} px wide on a phone of 390 px")
            page.close()
    return "4 kinds of data"


def Frame_Opened_ShowsEveryPlaneWithItsIdWhereItIs(browser, pages):
    page = browser.open(page_of(pages, "full"))
    scene(page)
    tags = page.run("[...document.querySelectorAll('#stage .tag.plane')].filter((e) => e.checkVisibility()).map((e) => e.textContent)")
    check(tags == ["1", "2", "3"], f"the scene has the ids {tags}")
    rows = page.run("[...document.querySelectorAll('#planes tbody tr')].map((r) => r.innerText.replace(/\\s+/g, ' '))")
    check(len(rows) == 3 and "tread" in rows[2] and "150 mm" in rows[2] and "0.80 m" in rows[2] and "0.700 m ahead" in rows[2], f"the figures of the upper tread are: {rows[2:]}")
    planes = page.run("window.polygmap.planes")
    off = np.abs(np.array(planes[1]["middle"]) - [RISER_X_M, 0, (FLOOR_Z_M + TREAD_Z_M) / 2]).max()
    check(off < 1e-3, f"the riser's middle is {off * 1e3:.1f} mm off")
    check(page.run("(() => { const i = document.querySelector('#picture img'); return i.complete && i.naturalWidth; })()") == WIDTH, "the picture with labels is not shown")
    page.close()
    return None


def Frame_Scene_DrawsKindsAndFollowsKeys(browser, pages):
    page = browser.open(page_of(pages, "full"))
    first = scene(page)
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(first))).convert("RGB")).reshape(-1, 3)
    check(len(np.unique(pixels, axis=0)) > 30, "the scene is blank")
    nosing = int((pixels == NOSING).all(1).sum())
    check(nosing > 200, f"the scene has {nosing} pixels of the nosing's colour")
    page.key("3")
    above = scene(page)
    check(above != first, "key 3 does not turn the scene")
    page.key("p")
    check(scene(page) != above, "key p does not hide the points")
    page.run("document.querySelector('#planes tbody button').click()")
    page.run(SETTLED)
    left = page.run("[...document.querySelectorAll('#stage .tag.plane')].filter((e) => e.checkVisibility()).map((e) => e.textContent)")
    check(left == ["1"], f"plane 1 alone is asked for, and shown are {left}")
    page.close()
    return None


def Frame_WithoutPlanes_SaysSo(browser, pages):
    page = browser.open(page_of(pages, "none"))
    check(page.run("[...document.querySelectorAll('#planes .missing')].some((e) => e.checkVisibility() && e.textContent.includes('No plane'))"), "a frame without planes does not say so")
    page.close()
    page = browser.open(page_of(pages, "unknown"))
    check("kinds are not known" in page.run("document.querySelector('#source').innerText"), "that up was assumed is not said")
    page.close()
    return None


def Frame_HostileNames_AreText(browser, pages):
    page = browser.open(page_of(pages, "hostile"))
    check("</script><b>step.png" in page.run("document.querySelector('header').innerText"), "the picture's name is not shown as it is")
    check(page.run("document.querySelectorAll('header b, header img').length") == 0, "a name became markup")
    page.close()
    return None


def Frame_WithoutWebGl_IsDrawnFromTheRight(browser, pages):
    page = browser.open(page_of(pages, "full"))
    check("no WebGL" in page.run("document.querySelector('#stage').innerText"), "the page does not say that there is no WebGL")
    ids = page.run("[...document.querySelectorAll('#stage svg text.plane')].map((e) => e.textContent)")
    check(ids == ["1", "2", "3"], f"the drawing has the ids {ids}")
    check(not page.complaints(), f"the console has: {page.complaints()}")
    page.close()
    return None


TESTS = {f.__name__: f for f in (Frame_AnyVariant_ComplainsOfNothingAndFitsAPhone, Frame_Opened_ShowsEveryPlaneWithItsIdWhereItIs,
                                 Frame_Scene_DrawsKindsAndFollowsKeys, Frame_WithoutPlanes_SaysSo, Frame_HostileNames_AreText)}
NO_WEBGL = {f.__name__: f for f in (Frame_WithoutWebGl_IsDrawnFromTheRight,)}
