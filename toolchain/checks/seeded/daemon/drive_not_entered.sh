# SPDX-License-Identifier: Apache-2.0
# expect: unprivileged: the drives heard .*11
# One drive was never told to enter motor mode.
sed -i 's/enters=12/enters=11/' unprivileged.robot
