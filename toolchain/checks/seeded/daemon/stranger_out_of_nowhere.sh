# SPDX-License-Identifier: Apache-2.0
# expect: stands: lio counted 2 of a foreign sender and 2 datagrams, and 0 were sent
# A stranger where there is none.
sed -i '/^device lio /s/datagrams=0 foreign_sender=0/datagrams=2 foreign_sender=2/' stands.daemon
