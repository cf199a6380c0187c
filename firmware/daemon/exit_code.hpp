// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace polygmap::daemon {

// Of polygmapd --config; docs/deploy.md says the same.
enum class ExitCode : int {
  kAsked = 0,          // asked to stop, and stopped on two feet, or before the drives had gains
  kStoppedItself = 1,  // the gait stopped first, or could not stop in time
  kConfiguration = 2,
  kDevice = 3,
  kNoRealTime = 4,
  kRecording = 5,  // as 0, but the recording that was asked for is not complete, or could not be begun
};
[[nodiscard]] constexpr int number_of(ExitCode code) noexcept { return static_cast<int>(code); }

}  // namespace polygmap::daemon
