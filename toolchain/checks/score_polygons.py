#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Does a polygon cover its own surface, and no other?

    score_polygons.py FRAMES RESULTS

FRAMES by stair_frames.py, RESULTS by `polygmap perceive --json RESULTS --labels RESULTS`. A surface's truth is the
plane that most of its labelled pixels show. Of the true pixels inside its polygons, those of another plane than that
are foreign: the share over all treads (floor too), the worst surface's, and the share of frames in which one has more
than 5 %. Of its plane's pixels that it labels, the share that its polygons cover, over all and the least. Pixels within 2 of a true plane's border count for neither. Needs Debian's python3-numpy
and python3-pil.
"""
import glob
import json
import os
import sys

import numpy as np
from PIL import Image, ImageDraw

LEAST_PX = 300  # of a surface's labels, as in score_planes.py
BORDER_PX = 2


def inner(truth):
    """Pixels whose neighbours all show the same plane."""
    same = np.ones(truth.shape, bool)
    for axis in (0, 1):
        for shift in range(-BORDER_PX, BORDER_PX + 1):
            same &= np.roll(truth, shift, axis) == truth
    return same


def main(frames, results):
    foreign_px, inside_px, covered_px, own_px, worst, least_covered, crossed = 0, 0, 0, 0, 0.0, 1.0, 0
    paths = sorted(glob.glob(os.path.join(frames, "*.json")))
    if not paths:
        sys.exit(f"no frames in {frames}")
    for path in paths:
        name, camera = os.path.basename(path)[:-5], json.load(open(path))
        truth = np.array(Image.open(os.path.join(frames, name + ".truth.png")))
        labels = np.array(Image.open(os.path.join(results, name + ".labels.png")))
        counted = inner(truth) & (truth > 0)
        frame_worst = 0.0
        for plane in json.load(open(os.path.join(results, name + ".planes.json")))["planes"]:
            mine = (labels == plane["id"]) & counted
            if plane["kind"] != "tread" or mine.sum() < LEAST_PX:
                continue
            label = np.bincount(truth[mine]).argmax()
            mask = Image.new("L", truth.shape[::-1])
            for piece in plane["pieces"]:
                corners = [(camera["cx"] + camera["fx"] * x / z, camera["cy"] + camera["fy"] * y / z) for x, y, z in piece["polygon"]]
                ImageDraw.Draw(mask).polygon(corners, fill=1)
            inside = (np.array(mask) > 0) & counted
            foreign, own = inside & (truth != label), mine & (truth == label)
            foreign_px, inside_px = foreign_px + foreign.sum(), inside_px + inside.sum()
            covered, own_here = (own & inside).sum(), max(own.sum(), 1)
            covered_px, own_px = covered_px + covered, own_px + own_here
            share = foreign.sum() / max(inside.sum(), 1)
            frame_worst, least_covered = max(frame_worst, share), min(least_covered, covered / own_here)
        worst, crossed = max(worst, frame_worst), crossed + (frame_worst > 0.05)
    print(f"foreign_share {foreign_px / max(inside_px, 1):.4f}\nforeign_worst {worst:.4f}\nforeign_frames {crossed / len(paths):.4f}")
    print(f"covered_share {covered_px / max(own_px, 1):.4f}\ncovered_least {least_covered:.4f}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
