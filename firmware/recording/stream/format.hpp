// SPDX-License-Identifier: Apache-2.0
// What a recording is: an MCAP file (mcap/) whose topics (schemas.hpp) any MCAP tool reads, and among them two that a
// replay lives by, all numbers little-endian.
//
// /parameters, field header: magic (8 bytes), version (u32), hash of the field lists (u64, fields.hpp), then, as u32
// count and the entries,
//   parameters: name, kind (u8), count (u32), values (bool, i32, u32, i64, f64, choice u8)
//   rows of the schedule: task, lane (u8), slots (u16), budget_us (i32), unit_cost_ns (i32), shed_order (u8)
//   the camera's intrinsics, and the gains that each drive can take at most. A name is a u16 length and the characters.
// /replay, one message for each frame of a lane, in the order in which a replay has to live them: records, each of
//   kind (u8), length of the rest (u32), then by kind
//     row        a call of a schedule's row: row (u8), cycle_ns (i64), units (i32), progress (u8), units left (i32);
//                u16 count of port calls and each of them: kind (u8), whether it gave something (bool), and what; of a
//                lane's first row how far the other lane was (i64), and which of its frames this one saw; the stage's
//                outputs
//     event      what the executive counted: lane (u8), code (u8), when (i64), times (u32)
//     stop       the operator asked for the end
//     cycle      what the executive did: lane (u8), cycle (u64), due_ns (i64), slot (u8), rows run, shed, deferred and
//                overrun (u32 masks), whether the cycle overran and whether it was run late (bool), cycles skipped
//                before (u64)
//     lost       frames of a lane (u8) that found no room before this one: how many (u32)
//     end        cycles (u64) and pictures (u32): a file without it was cut off
// The other topics repeat what is in the records: as long as a replay finds them the same, no bit was changed since.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::recording {

inline constexpr std::string_view kMagic = "PGMAPREC";
inline constexpr std::uint32_t kVersion = 7;

inline constexpr std::size_t kMaxCallsPerRow = 16;
inline constexpr std::uint32_t kMaxEntries = 4096;  // parameters or rows
// Times are within this: no sum of two of them overflows.
inline constexpr std::int64_t kLatest_ns = std::int64_t{1} << 60;

enum class RecordKind : std::uint8_t { kRow = 'R', kEvent = 'V', kStop = 'S', kCycle = 'C', kLost = 'L', kEnd = 'E' };
enum class CallKind : std::uint8_t {
  kReadImu = 1,
  kReadJoints = 2,
  kReadLidar = 3,
  kWriteJoints = 4,
  kAcquire = 5,
  kRelease = 6,
  kJointStatus = 7,
  kReadOperator = 8,
};
[[nodiscard]] constexpr std::string_view name_of(CallKind kind) noexcept {
  constexpr std::string_view kNames[] = {"no call",        "imu.try_read",     "joints.try_read",
                                         "lio.try_read",   "joints.try_write", "camera.try_acquire",
                                         "camera.release", "joints.status",    "operator.try_read"};
  return kNames[static_cast<std::size_t>(kind)];
}
enum class ValueKind : std::uint8_t { kBool, kI32, kU32, kI64, kF64, kChoice };
// Where a picture's pixels are.
enum class Pixels : std::uint8_t {
  kNone,         // there were none
  kStored,       // in the next message of /depth
  kOtherSize,    // than the camera's: the module refuses such a picture unseen
  kNotRecorded,  // nobody asked for pictures, or the driver had no buffer to spare
};

// Of a picture's pixels, eight bytes at a time. A flipped bit changes it.
[[nodiscard]] inline std::uint64_t hash_of_pixels(const std::uint16_t* pixels, std::size_t count) noexcept {
  std::uint64_t hash = 0xcbf29ce484222325U;
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4) {
    std::uint64_t word = 0;
    std::memcpy(&word, pixels + i, sizeof word);
    hash = (hash ^ word) * 0x100000001b3U;
    hash ^= hash >> 32U;
  }
  for (; i < count; ++i) hash = (hash ^ pixels[i]) * 0x100000001b3U;
  return hash;
}

// Of all names in the field lists: files of another build's lists are not read as this one's.
[[nodiscard]] std::uint64_t hash_of_fields() noexcept;

}  // namespace polygmap::recording
