# SPDX-License-Identifier: Apache-2.0
# expect: arming: it ended as safe_stop instead of arming
# It armed without a drive.
sed -i '/^stopped /s/state=arming/state=safe_stop/' arming.daemon
