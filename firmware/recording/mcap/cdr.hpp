// SPDX-License-Identifier: Apache-2.0
// Messages as ROS 2 has them on the wire: CDR, little-endian, each number at a multiple of its size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/recording/stream/bytes.hpp"

namespace polygmap::mcap {

inline constexpr std::size_t kCdrHead_bytes = 4;  // which encoding; places are counted from behind it

class CdrWriter {
 public:
  explicit CdrWriter(std::span<std::byte> memory) noexcept : out_(memory) { begin(); }

  // Another message.
  void begin() noexcept {
    out_.clear();
    constexpr std::uint8_t kLittleEndian[kCdrHead_bytes] = {0, 1, 0, 0};
    out_.put_bytes(kLittleEndian, sizeof kLittleEndian);
  }
  template <recording::Number T>
  void put(T value) noexcept {
    align(sizeof value);
    out_.put(value);
  }
  void put_text(std::string_view text) noexcept {
    put(static_cast<std::uint32_t>(text.size() + 1));
    out_.put_bytes(text.data(), text.size());
    out_.put(std::uint8_t{0});
  }
  // How many elements follow.
  void put_count(std::size_t count) noexcept { put(static_cast<std::uint32_t>(count)); }
  void put_bytes(std::span<const std::byte> bytes) noexcept {
    put_count(bytes.size());
    out_.put_bytes(bytes.data(), bytes.size());
  }
  // Full: it had no room for all, and is no message.
  [[nodiscard]] bool full() const noexcept { return out_.full(); }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return out_.bytes(); }

 private:
  void align(std::size_t size) noexcept {
    while ((out_.size() - kCdrHead_bytes) % size != 0 && !out_.full()) out_.put(std::uint8_t{0});
  }
  recording::ByteWriter out_;
};

// Reads what CdrWriter wrote. Fails as ByteReader does: then values are zero and failed() is true from there on.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::byte> message) noexcept
      : size_(message.size() < kCdrHead_bytes ? 0 : message.size() - kCdrHead_bytes),
        in_(message.subspan(message.size() - size_)) {
    constexpr std::byte kLittleEndian{1};
    if (message.size() < kCdrHead_bytes || message[1] != kLittleEndian) in_.fail();
  }
  template <recording::Number T>
  [[nodiscard]] T get() noexcept {
    while (in_.place() % sizeof(T) != 0 && !in_.failed()) take_zero();
    return in_.get<T>();
  }
  [[nodiscard]] std::string_view get_text() noexcept {
    const auto length = get<std::uint32_t>();
    const std::string_view text = in_.get_text(length);
    if (length == 0 || (!text.empty() && text.back() != '\0')) in_.fail();
    return text.substr(0, text.empty() ? 0 : text.size() - 1);
  }
  // A count of elements of at least so many bytes each: no larger than what is left holds.
  [[nodiscard]] std::size_t get_count(std::size_t element_bytes) noexcept {
    const auto count = get<std::uint32_t>();
    if (count > (size_ - in_.place()) / element_bytes) in_.fail();
    return in_.failed() ? 0 : count;
  }
  [[nodiscard]] std::span<const std::byte> get_bytes() noexcept {
    const std::string_view bytes = in_.get_text(get_count(1));
    return {reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()};
  }
  [[nodiscard]] bool failed() const noexcept { return in_.failed(); }

 private:
  // The writer fills with zeros: a bit flipped there is told of as anywhere else.
  void take_zero() noexcept {
    if (in_.get<std::uint8_t>() != 0) in_.fail();
  }
  std::size_t size_;
  recording::ByteReader in_;
};

}  // namespace polygmap::mcap
