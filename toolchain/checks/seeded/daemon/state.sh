# SPDX-License-Identifier: Apache-2.0
# expect: stands: it ended as running instead of safe_stop
# It ended in the middle of its work.
sed -i '/^stopped /s/state=safe_stop/state=running/' stands.daemon
