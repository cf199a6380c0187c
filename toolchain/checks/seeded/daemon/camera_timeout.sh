# SPDX-License-Identifier: Apache-2.0
# expect: stands: camera counted .*'timeouts': 1
# Half a second without a picture.
sed -i '/^device camera /s/timeouts=0/timeouts=1/' stands.daemon
