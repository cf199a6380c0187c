# SPDX-License-Identifier: Apache-2.0
# expect: one_lane: heap_calls=1
# One call of malloc in the cyclic path.
sed -i '/^stopped /s/heap_calls=0/heap_calls=1/' one_lane.daemon
