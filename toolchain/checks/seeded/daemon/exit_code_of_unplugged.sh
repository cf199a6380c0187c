# SPDX-License-Identifier: Apache-2.0
# expect: unplugged: exit code 0 instead of 1
# A robot that fell silent ends as if nothing were.
sed -i 's/^code=1 /code=0 /' unplugged.daemon
