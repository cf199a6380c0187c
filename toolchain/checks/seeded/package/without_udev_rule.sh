# SPDX-License-Identifier: Apache-2.0
# expect: it has no lib/udev/rules.d/60-polygmap.rules
# The camera would have a number that changes.
rm lib/udev/rules.d/60-polygmap.rules
