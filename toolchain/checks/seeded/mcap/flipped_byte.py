# SPDX-License-Identifier: Apache-2.0
# expect: rror.*[Cc][Rr][Cc]
# A byte of a sample of the joints is turned round.
import mcap_change as change

data = change.read()
message = [m for m in change.messages(data) if m["topic"] == "/joints"][1000]
data[message["begin"] + 60] ^= 0xFF
change.write(data)
