# SPDX-License-Identifier: Apache-2.0
# expect: no_right: exit code 4 instead of 4, or not 'CAP_IPC_LOCK'
# Which right is missing is not told.
: >no_right.said
