// SPDX-License-Identifier: Apache-2.0
// Numbers as little-endian bytes, into and out of memory that somebody else owns.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

namespace polygmap::recording {

static_assert(std::endian::native == std::endian::little, "numbers and pixels are written as they lie in memory");

template <class T>
concept Number = std::is_arithmetic_v<T> || std::is_enum_v<T>;

// Never writes past its memory: what found no room is told by full(). Does not allocate: a port may write through it
// while the module calls.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<std::byte> memory) noexcept : memory_(memory) {}

  template <Number T>
  void put(T value) noexcept {
    put_bytes(&value, sizeof value);
  }
  void put_bytes(const void* bytes, std::size_t count) noexcept {
    full_ = full_ || count > memory_.size() - size_;
    if (full_ || count == 0) return;
    std::memcpy(memory_.data() + size_, bytes, count);
    size_ += count;
  }
  // To be filled in by put_at().
  void skip(std::size_t count) noexcept {
    full_ = full_ || count > memory_.size() - size_;
    if (!full_) size_ += count;
  }
  // Over what was put at that place before.
  template <class T>
  requires Number<T> || std::is_same_v<typename T::value_type, std::byte>
  void put_at(std::size_t place, const T& value) noexcept {
    if (place + sizeof value <= size_) std::memcpy(memory_.data() + place, &value, sizeof value);
  }
  // The memory behind what was put, for somebody who fills some of it and says how much.
  [[nodiscard]] std::span<std::byte> rest() noexcept { return memory_.subspan(size_); }
  void advance(std::size_t count) noexcept { size_ += count; }
  void set_full() noexcept { full_ = true; }
  void clear() noexcept { size_ = 0; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] bool full() const noexcept { return full_; }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return memory_.first(size_); }

 private:
  std::span<std::byte> memory_;
  std::size_t size_ = 0;
  bool full_ = false;
};

// Never reads past its end: then values are zero and failed() is true from there on.
class ByteReader {
 public:
  ByteReader() = default;
  explicit ByteReader(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {}

  template <Number T>
  [[nodiscard]] T get() noexcept {
    if constexpr (std::is_same_v<T, bool>) {  // another byte than 0 and 1 is no bool
      const auto byte = get<std::uint8_t>();
      failed_ = failed_ || byte > 1;
      return byte == 1;
    } else {
      T value{};
      failed_ = failed_ || sizeof value > bytes_.size() - at_;
      if (failed_) return value;
      std::memcpy(&value, bytes_.data() + at_, sizeof value);
      at_ += sizeof value;
      return value;
    }
  }
  [[nodiscard]] std::string_view get_text(std::size_t count) noexcept {
    failed_ = failed_ || count > bytes_.size() - at_;
    if (failed_) return {};
    at_ += count;
    return {reinterpret_cast<const char*>(bytes_.data() + at_ - count), count};
  }
  [[nodiscard]] std::span<const std::byte> get_bytes(std::size_t count) noexcept {
    failed_ = failed_ || count > bytes_.size() - at_;
    if (failed_) return {};
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }
  // What was not read yet.
  [[nodiscard]] std::span<const std::byte> rest() const noexcept { return bytes_.subspan(at_); }
  void fail() noexcept { failed_ = true; }
  [[nodiscard]] bool failed() const noexcept { return failed_; }
  [[nodiscard]] bool at_end() const noexcept { return at_ == bytes_.size(); }
  [[nodiscard]] std::size_t place() const noexcept { return at_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

}  // namespace polygmap::recording
