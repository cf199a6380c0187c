# SPDX-License-Identifier: Apache-2.0
# expect: one_lane: lio counted .'good': 4.
# Poses of an address that nobody configured are taken.
sed -i '/^device lio /s/good=0/good=4/' one_lane.daemon
