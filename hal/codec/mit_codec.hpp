// SPDX-License-Identifier: Apache-2.0
// The frames of the MIT family of drives (CubeMars AK, Damiao, Ruiwo and others): 8 bytes, fields packed big-endian.
//
// Command: position 16 bits | velocity 12 | kp 12 | kd 12 | torque 12. Reply: byte 0 names the drive, position 16 |
// velocity 12 | torque 12, then, in a reply of 8 bytes, two bytes that differ from maker to maker: temperatures, and an
// error code. A field of n bits spans its range in 2^n - 1 steps and is rounded to the nearest.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::hal {

using MitBytes = std::array<std::uint8_t, 8>;

// As the drive is configured: +-p rad, +-v rad/s, +-t Nm, 0 to kp, 0 to kd.
struct MitRanges {
  double p_rad = 0.0;
  double v_radps = 0.0;
  double t_nm = 0.0;
  double kp_nmprad = 0.0;
  double kd_nmsprad = 0.0;
};

// What byte 0 of a reply says.
enum class MitReplyRule : std::uint8_t {
  // The drive's id. Byte 6 of a long reply is the motor's temperature, with its sign, byte 7 the error code (CubeMars).
  kId,
  // Status in the upper half, the id's lower half in the lower one. Byte 6 of a long reply is the transistors'
  // temperature, byte 7 the motor's, without a sign (Damiao).
  kStatusNibble,
};

// Frames that are no command: seven bytes 0xFF, then this.
enum class MitSpecial : std::uint8_t {
  kClearErrors = 0xFB,  // Damiao only
  kEnter = 0xFC,        // motor mode: from here on commands move the drive
  kExit = 0xFD,
  kZero = 0xFE,  // the present angle becomes zero, for good
};

struct MitReply {
  double p_rad = 0.0;
  double v_radps = 0.0;
  double t_nm = 0.0;
  std::uint8_t status = 0;  // by kStatusNibble the upper half of byte 0; by kId byte 7, 0 in a short reply
  bool enabled = true;      // false: the drive says that it is not in motor mode
  bool error = false;
  std::int16_t motor_degc = kNotTold_degc;  // whole degrees; short replies tell none
  std::int16_t mos_degc = kNotTold_degc;    // of its transistors; by kId never told
  [[nodiscard]] constexpr std::int16_t hottest_degc() const noexcept { return std::max(motor_degc, mos_degc); }
};

namespace detail {

struct MitField {
  std::size_t first_bit;  // from the most significant bit of byte 0
  std::size_t bits;
};
inline constexpr MitField kCommandP{0, 16}, kCommandV{16, 12}, kCommandKp{28, 12}, kCommandKd{40, 12},
    kCommandT{52, 12};
inline constexpr MitField kReplyP{8, 16}, kReplyV{24, 12}, kReplyT{36, 12};

[[nodiscard]] constexpr std::uint32_t steps_of(MitField field) noexcept { return (1U << field.bits) - 1U; }

// A frame's bytes as one number, byte 0 on top; those that a short one lacks are zero.
[[nodiscard]] constexpr std::uint64_t word_of(std::span<const std::uint8_t> bytes) noexcept {
  std::uint64_t word = 0;
  if (bytes.size() >= 8) {
    for (std::size_t i = 0; i < 8; ++i) word = word << 8U | bytes[i];  // one load, as compilers know
  } else {
    for (std::size_t i = 0; i < 8; ++i) word = word << 8U | (i < bytes.size() ? bytes[i] : 0U);
  }
  return word;
}
[[nodiscard]] constexpr MitBytes bytes_of(std::uint64_t word) noexcept {
  MitBytes bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(word >> (56U - 8U * i));
  return bytes;
}
[[nodiscard]] constexpr std::uint64_t placed(MitField field, std::uint32_t value) noexcept {
  return std::uint64_t{value} << (64U - field.first_bit - field.bits);
}
[[nodiscard]] constexpr std::uint32_t get(std::uint64_t word, MitField field) noexcept {
  return static_cast<std::uint32_t>(word >> (64U - field.first_bit - field.bits)) & steps_of(field);
}

[[nodiscard]] constexpr bool is_finite(double x) noexcept { return x - x == 0.0; }

// Rounds to the nearest step; what is outside becomes the nearest end, and clamped counts it.
[[nodiscard]] constexpr std::uint32_t quantised(double x, double least, double most, MitField field,
                                                std::uint32_t& clamped) noexcept {
  if (x < least || x > most) ++clamped;
  if (x <= least) return 0U;
  if (x >= most) return steps_of(field);
  return static_cast<std::uint32_t>((x - least) / (most - least) * steps_of(field) + 0.5);
}
[[nodiscard]] constexpr double value_of(std::uint32_t steps, double least, double most, MitField field) noexcept {
  // The upper end is the range's own: rounded, it may lie beyond.
  return steps == steps_of(field) ? most : least + (most - least) * steps / steps_of(field);
}

}  // namespace detail

[[nodiscard]] constexpr MitBytes special_frame(MitSpecial special) noexcept {
  return {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, static_cast<std::uint8_t>(special)};
}
[[nodiscard]] constexpr bool is_special_frame(const MitBytes& bytes) noexcept {
  for (std::size_t i = 0; i < 7; ++i) {
    if (bytes[i] != 0xFF) return false;
  }
  return bytes[7] >= static_cast<std::uint8_t>(MitSpecial::kClearErrors) &&
         bytes[7] <= static_cast<std::uint8_t>(MitSpecial::kZero);
}

// False, and bytes untouched, when a value is not finite. clamped grows by the fields that their range could not hold.
// A command that would read as a special frame, every field at its upper end, is sent with kd one step lower.
[[nodiscard]] constexpr bool try_encode_command(const JointSetpoint& command, const MitRanges& ranges, MitBytes& bytes,
                                                std::uint32_t& clamped) noexcept {
  using namespace detail;
  for (const double x : {command.q_rad, command.dq_radps, command.tau_ff_nm, command.kp_nmprad, command.kd_nmsprad}) {
    if (!is_finite(x)) return false;
  }
  std::uint64_t word = placed(kCommandP, quantised(command.q_rad, -ranges.p_rad, ranges.p_rad, kCommandP, clamped));
  word |= placed(kCommandV, quantised(command.dq_radps, -ranges.v_radps, ranges.v_radps, kCommandV, clamped));
  word |= placed(kCommandKp, quantised(command.kp_nmprad, 0.0, ranges.kp_nmprad, kCommandKp, clamped));
  word |= placed(kCommandKd, quantised(command.kd_nmsprad, 0.0, ranges.kd_nmsprad, kCommandKd, clamped));
  word |= placed(kCommandT, quantised(command.tau_ff_nm, -ranges.t_nm, ranges.t_nm, kCommandT, clamped));
  bytes = bytes_of(word);
  if (is_special_frame(bytes)) bytes[6] = 0xEF;
  return true;
}

// As the drive reads it; for the simulation and for people. Special frames are none.
[[nodiscard]] constexpr bool try_decode_command(const MitBytes& bytes, const MitRanges& ranges,
                                                JointSetpoint& command) noexcept {
  using namespace detail;
  if (is_special_frame(bytes)) return false;
  const std::uint64_t word = word_of(bytes);
  command.q_rad = value_of(get(word, kCommandP), -ranges.p_rad, ranges.p_rad, kCommandP);
  command.dq_radps = value_of(get(word, kCommandV), -ranges.v_radps, ranges.v_radps, kCommandV);
  command.kp_nmprad = value_of(get(word, kCommandKp), 0.0, ranges.kp_nmprad, kCommandKp);
  command.kd_nmsprad = value_of(get(word, kCommandKd), 0.0, ranges.kd_nmsprad, kCommandKd);
  command.tau_ff_nm = value_of(get(word, kCommandT), -ranges.t_nm, ranges.t_nm, kCommandT);
  return true;
}

// Of byte 0: which drive speaks.
[[nodiscard]] constexpr std::uint8_t reply_name(std::uint32_t drive_id, MitReplyRule rule) noexcept {
  return static_cast<std::uint8_t>(rule == MitReplyRule::kStatusNibble ? drive_id & 0x0FU : drive_id & 0xFFU);
}
// bytes: at least one.
[[nodiscard]] constexpr std::uint8_t name_in_reply(std::span<const std::uint8_t> bytes, MitReplyRule rule) noexcept {
  return reply_name(bytes[0], rule);
}

// False, and reply untouched, unless there are 6 or 8 bytes of that drive. Every such frame has values within the
// range.
[[nodiscard]] constexpr bool try_decode_reply(std::span<const std::uint8_t> bytes, std::uint32_t drive_id,
                                              const MitRanges& ranges, MitReplyRule rule, MitReply& reply) noexcept {
  using namespace detail;
  if (bytes.size() != 6 && bytes.size() != 8) return false;
  if (name_in_reply(bytes, rule) != reply_name(drive_id, rule)) return false;
  reply = {};
  const std::uint64_t word = word_of(bytes);
  reply.p_rad = value_of(get(word, kReplyP), -ranges.p_rad, ranges.p_rad, kReplyP);
  reply.v_radps = value_of(get(word, kReplyV), -ranges.v_radps, ranges.v_radps, kReplyV);
  reply.t_nm = value_of(get(word, kReplyT), -ranges.t_nm, ranges.t_nm, kReplyT);
  if (rule == MitReplyRule::kStatusNibble) {
    constexpr std::uint8_t kDisabled = 0, kFirstError = 8;
    reply.status = static_cast<std::uint8_t>(bytes[0] >> 4U);
    reply.enabled = reply.status != kDisabled;
    reply.error = reply.status >= kFirstError;
    if (bytes.size() == 8) {
      reply.mos_degc = bytes[6];
      reply.motor_degc = bytes[7];
    }
  } else if (bytes.size() == 8) {
    reply.motor_degc = static_cast<std::int8_t>(bytes[6]);
    reply.status = bytes[7];
    reply.error = reply.status != 0;
  }
  return true;
}

// As a drive sends it, 8 bytes; for the simulation. Not finite, or not told: zero. A temperature that the byte has no
// room for becomes its nearest end.
[[nodiscard]] constexpr MitBytes reply_frame(const MitReply& reply, std::uint32_t drive_id, const MitRanges& ranges,
                                             MitReplyRule rule) noexcept {
  using namespace detail;
  const auto finite = [](double x) { return is_finite(x) ? x : 0.0; };
  std::uint32_t clamped = 0;
  std::uint64_t word = placed(kReplyP, quantised(finite(reply.p_rad), -ranges.p_rad, ranges.p_rad, kReplyP, clamped));
  word |= placed(kReplyV, quantised(finite(reply.v_radps), -ranges.v_radps, ranges.v_radps, kReplyV, clamped));
  word |= placed(kReplyT, quantised(finite(reply.t_nm), -ranges.t_nm, ranges.t_nm, kReplyT, clamped));
  MitBytes bytes = bytes_of(word);
  const std::uint32_t upper = rule == MitReplyRule::kStatusNibble ? reply.status : 0U;
  bytes[0] = static_cast<std::uint8_t>(reply_name(drive_id, rule) | upper << 4U);
  const auto degc = [](std::int16_t told, int least, int most) {
    return static_cast<std::uint8_t>(told == kNotTold_degc ? 0 : std::clamp<int>(told, least, most));
  };
  if (rule == MitReplyRule::kId) {
    bytes[6] = degc(reply.motor_degc, -128, 127);
    bytes[7] = reply.status;
  } else {
    bytes[6] = degc(reply.mos_degc, 0, 255);
    bytes[7] = degc(reply.motor_degc, 0, 255);
  }
  return bytes;
}

// Vertical forces of both feet, left first: two big-endian numbers of 16 bits, unit_n each.
inline constexpr std::size_t kFootFrame_bytes = 4;
[[nodiscard]] constexpr bool try_decode_feet(std::span<const std::uint8_t> bytes, double unit_n,
                                             std::array<double, kFootCount>& force_n) noexcept {
  if (bytes.size() != kFootFrame_bytes) return false;
  for (std::size_t f = 0; f < kFootCount; ++f) force_n[f] = unit_n * (bytes[2 * f] << 8U | bytes[2 * f + 1]);
  return true;
}
// Pulling feet, and what is not finite, are zero.
[[nodiscard]] constexpr std::array<std::uint8_t, kFootFrame_bytes> feet_frame(
    const std::array<double, kFootCount>& force_n, double unit_n) noexcept {
  std::array<std::uint8_t, kFootFrame_bytes> bytes{};
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const double units = detail::is_finite(force_n[f]) ? force_n[f] / unit_n : 0.0;
    const auto whole = static_cast<std::uint32_t>(units <= 0.0 ? 0.0 : (units >= 65535.0 ? 65535.0 : units + 0.5));
    bytes[2 * f] = static_cast<std::uint8_t>(whole >> 8U);
    bytes[2 * f + 1] = static_cast<std::uint8_t>(whole & 0xFFU);
  }
  return bytes;
}

}  // namespace polygmap::hal
