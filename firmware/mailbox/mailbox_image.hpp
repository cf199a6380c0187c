// SPDX-License-Identifier: Apache-2.0
// A mailbox's sections as a live view is made of them.
#pragma once

#include "firmware/live/live_view.hpp"
#include "firmware/mailbox/mailbox_layout.hpp"
#include "firmware/mailbox/polygmap_mailbox_reader.h"

namespace polygmap {

// Those that were never written stay empty. False: there is no whole status now.
[[nodiscard]] bool read_image(const polygmap_mailbox& box, MailboxImage& image);

}  // namespace polygmap
