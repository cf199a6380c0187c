# SPDX-License-Identifier: Apache-2.0
# expect: etc/polygmap has mode 0777 instead of 0755
# Its files could be replaced.
chmod 777 etc/polygmap
