// SPDX-License-Identifier: Apache-2.0
// What came of the operator's command.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

// Why the module does not do as it was asked. All but the first two are of a reset: what stopped it is not over.
enum class Refusal : std::uint8_t {
  kNone,            // it does
  kState,           // the state has no answer to the command
  kDrivesSilent,    // the answer names their joints, as those of the next two
  kDrivesInError,   //
  kDrivesHot,       //
  kCommandRefused,  // by the bus, or it was not finite
  kEstimateStale,   //
  kFootLifted,      // by the estimate one foot does not carry, or both
  kJointsAway,      // from where they were commanded; the answer names them
  kNoPlace,         // the destination of a go_to is not valid
};
// Joints go behind it.
[[nodiscard]] constexpr std::string_view text_of(Refusal refusal) noexcept {
  constexpr std::array<std::string_view, 10> kTexts{"",
                                                    "",
                                                    "no answer yet from",
                                                    "in error:",
                                                    "too hot:",
                                                    "the last command did not reach the drives",
                                                    "the estimate is too old",
                                                    "not both feet carry",
                                                    "not where commanded:",
                                                    "that is no place within 50 m, or no turn within 3.2 rad"};
  static_assert(kTexts.size() == static_cast<std::size_t>(Refusal::kNoPlace) + 1);
  return kTexts[static_cast<std::size_t>(refusal)];
}

struct OperatorAnswer {
  Refusal refusal = Refusal::kNone;
  JointSet joints;  // that the refusal is about

  [[nodiscard]] constexpr bool is_obeyed() const noexcept { return refusal == Refusal::kNone; }
  [[nodiscard]] constexpr bool operator==(const OperatorAnswer&) const noexcept = default;
};

}  // namespace polygmap
