# SPDX-License-Identifier: Apache-2.0
# expect: stands: exit code 3 instead of 0
# It said that it failed.
sed -i 's/^code=0 /code=3 /' stands.daemon
