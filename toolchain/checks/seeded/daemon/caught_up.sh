# SPDX-License-Identifier: Apache-2.0
# expect: unplugged: caught_up=1
# A cycle that was run late.
sed -i '/^stopped /s/caught_up=0/caught_up=1/' unplugged.daemon
