// SPDX-License-Identifier: Apache-2.0
// Counts what happened, by code. Which codes there are, the table of each enumeration says.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>

namespace polygmap {

// One line of an enumeration's table. The number is the enumerator's own and never changes.
template <typename Code>
struct EventInfo {
  Code code;
  std::string_view name;  // as reports have it
  std::string_view text;  // one sentence
  [[nodiscard]] constexpr int number() const noexcept { return static_cast<int>(code); }
};

// An enumeration whose events can be counted specialises this with its std::array<EventInfo<Code>, N>.
template <typename Code>
inline constexpr std::array<EventInfo<Code>, 0> kEventTable{};

// Where a code stands in its table; the table's size for a number that it does not have. Numbers may have gaps.
template <typename Code>
[[nodiscard]] constexpr std::size_t index_of_event(Code code) noexcept {
  static_assert(sizeof(Code) == 1 && kEventTable<Code>.size() > 0, "an enumeration of bytes with a table");
  constexpr auto kIndex = [] {
    std::array<std::uint8_t, 256> index{};
    index.fill(static_cast<std::uint8_t>(kEventTable<Code>.size()));
    for (std::size_t i = 0; i < kEventTable<Code>.size(); ++i) {
      index[static_cast<std::uint8_t>(kEventTable<Code>[i].code)] = static_cast<std::uint8_t>(i);
    }
    return index;
  }();
  return kIndex[static_cast<std::uint8_t>(code)];
}

// "unknown" outside the table.
template <typename Code>
[[nodiscard]] constexpr std::string_view name_of_event(Code code) noexcept {
  const std::size_t i = index_of_event(code);
  return i < kEventTable<Code>.size() ? kEventTable<Code>[i].name : "unknown";
}

// For static_assert: lines of a table whose number is outside [first, last] or not above the one before, or that lack a
// name of their own or a text.
template <typename Code>
[[nodiscard]] constexpr std::size_t bad_event_lines(int first, int last) noexcept {
  std::size_t bad = 0;
  const auto& table = kEventTable<Code>;
  for (std::size_t i = 0; i < table.size(); ++i) {
    bool good = table[i].number() >= first && table[i].number() <= last && !table[i].text.empty();
    good = good && !table[i].name.empty() && (i == 0 || table[i].number() > table[i - 1].number());
    for (std::size_t j = 0; j < i; ++j) good = good && table[j].name != table[i].name;
    bad += good ? 0 : 1;
  }
  return bad;
}

struct EventCount {
  std::uint32_t count = 0;  // saturates
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
};

// One per lane, written by that lane's thread only (its tasks and its executive); a copy crosses lanes through an
// Exchange and is merged by the reader.
template <typename... Codes>
class EventCounters {
 public:
  template <typename Code>
  constexpr void raise(Code code, std::int64_t now_ns, std::uint32_t times = 1) noexcept {
    const std::size_t i = index_of_event(code);
    if (i >= kEventTable<Code>.size() || times == 0) return;
    EventCount& c = of<Code>()[i];
    if (c.count == 0) c.first_ns = now_ns;
    c.last_ns = now_ns;
    c.count = saturating_sum(c.count, times);
    raised_ += times;
  }
  // Another number than before when a count has changed since: for who looks in every cycle. Wraps.
  [[nodiscard]] constexpr std::uint32_t raised() const noexcept { return raised_; }
  // As often as a stage's own counter has grown since this was last told of it, from 0 on. A code follows one counter.
  template <typename Code>
  constexpr void follow(Code code, std::int64_t now_ns, std::uint32_t stage_total) noexcept {
    const std::size_t i = index_of_event(code);
    if (i >= kEventTable<Code>.size()) return;
    std::uint32_t& seen = std::get<Totals<Code>>(followed_)[i];
    raise(code, now_ns, stage_total - seen);
    seen = stage_total;
  }

  // Zero outside the table.
  template <typename Code>
  [[nodiscard]] constexpr EventCount count(Code code) const noexcept {
    const std::size_t i = index_of_event(code);
    return i < kEventTable<Code>.size() ? of<Code>()[i] : EventCount{};
  }
  // Of all codes, in the order of their table.
  template <typename Code>
  [[nodiscard]] constexpr std::span<const EventCount> counts() const noexcept {
    return of<Code>();
  }
  template <typename Code>
  [[nodiscard]] constexpr bool any() const noexcept {
    return std::any_of(of<Code>().begin(), of<Code>().end(), [](const EventCount& c) { return c.count > 0; });
  }
  template <typename Code>
  constexpr void clear(Code code) noexcept {
    const std::size_t i = index_of_event(code);
    if (i < kEventTable<Code>.size()) of<Code>()[i] = {};
    ++raised_;
  }
  constexpr void clear() noexcept {
    (of<Codes>().fill({}), ...);
    ++raised_;
  }

  // As they were counted elsewhere, in the order of the tables: for who replays a lane without its tasks.
  constexpr void assign(std::span<const EventCount> counts) noexcept {
    const auto assign_to = [&counts](auto& own) {
      for (std::size_t i = 0; i < own.size() && i < counts.size(); ++i) own[i] = counts[i];
      counts = counts.subspan(std::min(own.size(), counts.size()));
    };
    (assign_to(of<Codes>()), ...);
    ++raised_;
  }

  // Adds another lane's counts.
  constexpr void merge(const EventCounters& other) noexcept {
    (merge_in(of<Codes>(), other.of<Codes>()), ...);
    raised_ += other.raised_;
  }

 private:
  // Arrays of a length alone would be one type for two enumerations.
  template <typename Code>
  struct Counts : std::array<EventCount, kEventTable<Code>.size()> {};
  template <typename Code>
  struct Totals : std::array<std::uint32_t, kEventTable<Code>.size()> {};

  template <typename Code>
  [[nodiscard]] constexpr Counts<Code>& of() noexcept {
    return std::get<Counts<Code>>(counts_);
  }
  template <typename Code>
  [[nodiscard]] constexpr const Counts<Code>& of() const noexcept {
    return std::get<Counts<Code>>(counts_);
  }
  static constexpr std::uint32_t saturating_sum(std::uint32_t a, std::uint32_t b) noexcept {
    return b > std::numeric_limits<std::uint32_t>::max() - a ? std::numeric_limits<std::uint32_t>::max() : a + b;
  }
  template <typename Code>
  static constexpr void merge_in(Counts<Code>& counts, const Counts<Code>& other) noexcept {
    for (std::size_t i = 0; i < counts.size(); ++i) {
      if (other[i].count == 0) continue;
      EventCount& c = counts[i];
      c.first_ns = c.count == 0 ? other[i].first_ns : std::min(c.first_ns, other[i].first_ns);
      c.last_ns = c.count == 0 ? other[i].last_ns : std::max(c.last_ns, other[i].last_ns);
      c.count = saturating_sum(c.count, other[i].count);
    }
  }

  std::tuple<Counts<Codes>...> counts_{};
  std::tuple<Totals<Codes>...> followed_{};  // the stages' counters as last told
  std::uint32_t raised_ = 0;
};

}  // namespace polygmap
