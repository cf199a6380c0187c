# SPDX-License-Identifier: Apache-2.0
# expect: stands: overruns=None
# What is not told counts as wrong.
sed -i '/^stopped /s/ overruns=0//' stands.daemon
