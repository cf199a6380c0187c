// SPDX-License-Identifier: Apache-2.0
// The topics of a recording, and what each one's messages are made of: ROS 2's and Foxglove's own definitions where
// there is one.
#pragma once

#include <array>
#include <cstdint>

#include "firmware/recording/mcap/mcap_writer.hpp"

namespace polygmap::recording {

enum class Topic : std::uint8_t {
  kParameters,  // all values, once
  kReplay,      // everything, exactly, in the order in which it is to be lived again
  kImu,         // what the module was given
  kJoints,      //
  kFeet,        //
  kLio,         //
  kDepth,       //
  kCameraInfo,  //
  kCommands,    // what it answered
  kGains,       //
  kOdometry,    // what it thought
  kTransforms,  //
  kSurfaces,    //
  kMap,         //
  kFootholds,   //
  kGait,        //
  kFrame,       // what the executive did
  kFaults,      //
  kTruth,       // what a simulation knows, written by whoever runs it
  kTruthFeet,   //
  kStairs,      //
  kPreview,     // small pictures
  kVerdict,     //
};
inline constexpr std::size_t kTopicCount = static_cast<std::size_t>(Topic::kVerdict) + 1;
static_assert(kTopicCount <= mcap::kMaxChannels);

// By Topic.
[[nodiscard]] const std::array<mcap::Channel, kTopicCount>& channels() noexcept;
[[nodiscard]] inline std::string_view name_of(Topic topic) noexcept {
  return channels()[static_cast<std::size_t>(topic)].topic;
}

}  // namespace polygmap::recording
