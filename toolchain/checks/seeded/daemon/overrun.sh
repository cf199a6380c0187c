# SPDX-License-Identifier: Apache-2.0
# expect: stands: overruns=2
# Two cycles that took too long.
sed -i '/^stopped /s/overruns=0/overruns=2/' stands.daemon
