# SPDX-License-Identifier: Apache-2.0
# expect: its example of a reader does not compile with its headers
# Headers of another version.
sed -i "s/polygmap_mailbox_attach/polygmap_mailbox_open/" usr/include/polygmap/polygmap_mailbox_reader.h
