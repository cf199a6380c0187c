// SPDX-License-Identifier: Apache-2.0
#include "firmware/mailbox/mailbox_image.hpp"

namespace polygmap {

bool read_image(const polygmap_mailbox& box, MailboxImage& image) {
  if (!image.has_names) image.names = box.names;  // written once, before anybody could attach
  image.has_names = true;
  image.is_virtual = box.header.clock == POLYGMAP_MAILBOX_VIRTUAL;
  image.epoch_ns = image.is_virtual ? 0 : box.header.opened_ns;
  (void)polygmap_mailbox_try_copy(&box.timing_lock, &box.timing, &image.timing, sizeof image.timing);
  (void)polygmap_mailbox_try_copy(&box.events_lock, &box.events, &image.events, sizeof image.events);
  return polygmap_mailbox_try_copy(&box.status_lock, &box.status, &image.status, sizeof image.status);
}

}  // namespace polygmap
