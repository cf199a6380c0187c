# SPDX-License-Identifier: Apache-2.0
# expect: unprivileged: page_faults=1
# Memory that was not locked.
sed -i '/^stopped /s/page_faults=0/page_faults=1/' unprivileged.daemon
