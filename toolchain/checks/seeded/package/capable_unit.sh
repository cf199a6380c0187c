# SPDX-License-Identifier: Apache-2.0
# expect: its unit says .* instead of CapabilityBoundingSet=
# The service could set the clock and every priority.
sed -i "s/^CapabilityBoundingSet=.*/CapabilityBoundingSet=CAP_SYS_NICE/" lib/systemd/system/polygmapd.service
