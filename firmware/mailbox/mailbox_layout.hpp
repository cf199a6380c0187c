// SPDX-License-Identifier: Apache-2.0
// The mailbox's layout as this build has it, known while compiling.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/link/abi.hpp"
#include "firmware/mailbox/polygmap_mailbox.h"

namespace polygmap {

struct MailboxField {
  std::string_view structure;
  std::size_t offset, size, structure_size;
};
inline constexpr auto kMailboxFields = std::to_array<MailboxField>({
#define POLYGMAP_MAILBOX_LINE(type, field) {#type, offsetof(type, field), sizeof(type::field), sizeof(type)},
    POLYGMAP_MAILBOX_FIELDS(POLYGMAP_MAILBOX_LINE)
#undef POLYGMAP_MAILBOX_LINE
});
// Fields between which there is room that no field of the list takes: one is missing there, or the compiler pads.
[[nodiscard]] constexpr std::size_t mailbox_gaps() noexcept {
  std::size_t gaps = 0;
  for (std::size_t i = 0; i < kMailboxFields.size(); ++i) {
    const MailboxField& field = kMailboxFields[i];
    const bool is_first = i == 0 || kMailboxFields[i - 1].structure != field.structure;
    const bool is_last = i + 1 == kMailboxFields.size() || kMailboxFields[i + 1].structure != field.structure;
    const std::size_t begin = is_first ? 0 : kMailboxFields[i - 1].offset + kMailboxFields[i - 1].size;
    // The sections of the segment begin at cache lines of their own; structs of polygmap.h may be padded.
    const bool is_segment = field.structure == "polygmap_mailbox";
    const std::size_t most = is_segment ? 63 : field.structure.starts_with("polygmap_mailbox_") ? 0 : 7;
    gaps += field.offset - begin > most ? 1U : 0U;
    gaps += is_last && field.structure_size - field.offset - field.size > most ? 1U : 0U;
  }
  return gaps;
}
static_assert(mailbox_gaps() == 0, "a field is not in POLYGMAP_MAILBOX_FIELDS, or has a gap before it");

inline constexpr std::uint64_t kMailboxLayoutHash = polygmap_mailbox_layout_hash();

}  // namespace polygmap
