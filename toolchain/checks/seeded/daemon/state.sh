# SPDX-License-Identifier: Apache-2.0
# expect: stands: it ended as walking_up instead of safe_stop
# It ended in the middle of its work.
sed -i '/^stopped /s/state=safe_stop/state=walking_up/' stands.daemon
