# SPDX-License-Identifier: Apache-2.0
# expect: unprivileged: vcan0 counted .*'refused': 1
# A command that found no room.
sed -i '/^device vcan0 /s/ refused=0/ refused=1/' unprivileged.daemon
