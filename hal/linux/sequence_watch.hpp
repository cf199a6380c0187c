// SPDX-License-Identifier: Apache-2.0
// What a packet's sequence number says about it.
#pragma once

#include <cstdint>

#include "hal/linux/system/descriptor.hpp"

namespace polygmap::hal {

enum class SequenceVerdict : std::uint8_t {
  kNext,
  kGap,         // ahead: packets between were lost, or come out of order
  kRepeated,    // the last one again
  kOutOfOrder,  // behind
  kJumped,      // further away than packets get lost: forged, or a sender that started anew
  kRestarted,   // the sender did start anew: so many packets in a row said so
};
struct SequenceCounters {  // saturate
  std::uint32_t repeated = 0;
  std::uint32_t out_of_order = 0;
  std::uint32_t jumped = 0;
  std::uint32_t missing = 0;   // numbers never seen, or seen out of order
  std::uint32_t restarts = 0;  // of the sender
};

class SequenceWatch {
 public:
  struct Params {
    std::uint32_t farthest = 100;  // in packets, to both sides
    std::uint32_t confirm = 5;     // packets that continue each other and not the last accepted one: a new start
  };
  constexpr SequenceWatch() noexcept = default;
  explicit constexpr SequenceWatch(const Params& params) noexcept : params_(params) {}

  [[nodiscard]] constexpr SequenceVerdict judge(std::uint32_t sequence) noexcept {
    if (!started_) return accept(sequence, SequenceVerdict::kNext);
    const std::uint32_t ahead = sequence - last_, behind = last_ - sequence;  // modulo 2^32: numbers wrap around
    if (ahead == 0) return SequenceVerdict::kRepeated;
    if (ahead == 1) return accept(sequence, SequenceVerdict::kNext);
    if (ahead <= params_.farthest) {
      lost_ = ahead - 1;
      return accept(sequence, SequenceVerdict::kGap);
    }
    run_ = run_ > 0 && sequence == run_last_ + 1 ? run_ + 1 : 1;
    run_last_ = sequence;
    if (run_ >= params_.confirm) return accept(sequence, SequenceVerdict::kRestarted);
    return behind <= params_.farthest ? SequenceVerdict::kOutOfOrder : SequenceVerdict::kJumped;
  }
  // Whether the packet is taken: it is the next, or comes after a gap or a restart. Counts what it is not.
  [[nodiscard]] constexpr bool takes(std::uint32_t sequence, SequenceCounters& counters) noexcept {
    switch (judge(sequence)) {
      case SequenceVerdict::kNext:
        return true;
      case SequenceVerdict::kGap:
        count_up(counters.missing, lost_);
        return true;
      case SequenceVerdict::kRestarted:
        count_up(counters.restarts);
        return true;
      case SequenceVerdict::kRepeated:
        count_up(counters.repeated);
        break;
      case SequenceVerdict::kOutOfOrder:
        count_up(counters.out_of_order);
        break;
      case SequenceVerdict::kJumped:
        count_up(counters.jumped);
        break;
    }
    return false;
  }

 private:
  constexpr SequenceVerdict accept(std::uint32_t sequence, SequenceVerdict verdict) noexcept {
    started_ = true;
    last_ = sequence;
    run_ = 0;
    return verdict;
  }

  Params params_;
  bool started_ = false;
  std::uint32_t last_ = 0;
  std::uint32_t run_ = 0;
  std::uint32_t run_last_ = 0;
  std::uint32_t lost_ = 0;  // before the packet last judged kGap
};

}  // namespace polygmap::hal
