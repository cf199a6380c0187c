# SPDX-License-Identifier: Apache-2.0
# expect: stands: it took longer than a second to stop
# A second and a half from SIGTERM to the end.
sed -i 's/^code=0 asked=.*/code=0 asked=6.32 ended=7.82/' stands.daemon
