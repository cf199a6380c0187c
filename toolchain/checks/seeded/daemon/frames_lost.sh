# SPDX-License-Identifier: Apache-2.0
# expect: stands: vcan2 counted .*'lost': 3
# Frames that the kernel dropped.
sed -i '/^device vcan2 /s/ lost=0/ lost=3/' stands.daemon
