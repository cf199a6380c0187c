# SPDX-License-Identifier: Apache-2.0
# expect: error: lost_camera: gait changed in 1 seconds, first in 3, last in 3
# The file has another hash for what the gait left in one second.
import pathlib
import re

path = pathlib.Path("lost_camera.txt")
path.write_text(re.sub(r"(?m)^3 gait \w+$", "3 gait 0123456789abcdef", path.read_text()))
