# SPDX-License-Identifier: Apache-2.0
# expect: one_lane: lio counted 0 of a foreign sender and 19 datagrams, and 19 were sent
# What came from a stranger is dropped without a word.
sed -i '/^device lio /s/foreign_sender=19/foreign_sender=0/' one_lane.daemon
