// SPDX-License-Identifier: Apache-2.0
// What each row of the schedule leaves behind, and how fields are written, read and compared.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "firmware/recording/stream/fields.hpp"
#include "firmware/schedule.hpp"

namespace polygmap::recording {

// The row that settles what its lane sees of the other one.
[[nodiscard]] constexpr bool looks_across(std::size_t row) noexcept {
  constexpr std::uint32_t kRows = [] {
    std::uint32_t rows = 1;
    for (std::size_t i = 1; i < kTasks.size(); ++i)
      rows |= (kTasks[i - 1].row.lane != kTasks[i].row.lane ? 1U : 0U) << i;
    return rows;
  }();
  return (kRows >> row & 1U) != 0;
}

[[nodiscard]] constexpr std::size_t row_of(std::string_view task) noexcept {
  std::size_t row = 0;
  while (kTasks[row].row.task != task) ++row;
  return row;
}
inline constexpr std::size_t kEstimateRow = row_of("estimate"), kGaitRow = row_of("gait"),
                             kHealthRow = row_of("health"), kIntakeRow = row_of("intake"),
                             kSurfacesRow = row_of("surfaces"), kMapRow = row_of("map"),
                             kFootholdsRow = row_of("footholds");

// Of all faults and limits, in the order of their tables.
using HealthCounts = std::array<EventCount, kFaultTable.size() + kLimitTable.size()>;
[[nodiscard]] inline HealthCounts counts_of(const Health& health) noexcept {
  HealthCounts counts;
  const auto faults_end = std::ranges::copy(health.counts<Fault>(), counts.begin()).out;
  std::ranges::copy(health.counts<Limit>(), faults_end);
  return counts;
}
void walk_health(auto& f, const HealthCounts& counts) {
  for (std::size_t i = 0; i < counts.size(); ++i) {
    walk(f, i < kFaultTable.size() ? kFaultTable[i].name : kLimitTable[i - kFaultTable.size()].name, counts[i]);
  }
}
// Written where they changed: f.health(health).

// Whether it makes any.
[[nodiscard]] constexpr bool has_outputs(std::size_t row, Progress progress) noexcept {
  constexpr std::uint32_t kAlways = 1U << kEstimateRow | 1U << kGaitRow | 1U << kHealthRow | 1U << kIntakeRow;
  constexpr std::uint32_t kWhenDone = 1U << kSurfacesRow | 1U << kMapRow | 1U << kFootholdsRow;
  return ((progress == Progress::kDone ? kAlways | kWhenDone : kAlways) >> row & 1U) != 0;
}

// What the writer's row has just published in its frame, where it did. The other lane does not see it before the frame
// is over, so nobody has taken it.
template <class T, std::size_t Slots>
[[nodiscard]] const T& published_in(const Exchange<T, Slots>& exchange, std::int64_t frame_ns) noexcept {
  static const T kNone{};
  const T* const value = exchange.published_ns() == frame_ns ? exchange.find(frame_ns) : nullptr;
  return value != nullptr ? *value : kNone;
}

// f sees what the row has just made.
void walk_outputs(auto& f, const Pipeline& module, std::size_t row, std::int64_t cycle_ns, Progress progress) {
  const ControlLane& control = module.control();
  const PerceptionLane& perception = module.perception();
  if (row == kEstimateRow) {
    walk(f, "state", control.state());
    walk(f, "quality", control.estimator().quality());
  } else if (row == kGaitRow) {
    walk(f, "status", control.gait_status());
    const ModuleState module_state = control.module_state();
    walk(f, "module_state", module_state);
  } else if (row == kHealthRow) {
    f.health(control.all_faults());
  } else if (row == kIntakeRow) {
    f.health(published_in(module.published_health(kPerceptionLane), cycle_ns));
    const PoseRequest& request = published_in(module.link().pose_request, cycle_ns);
    walk(f, "pose_request", request);
  } else if (progress != Progress::kDone) {
    return;
  } else if (row == kSurfacesRow) {
    const CameraExtrinsicsEstimator& mount = perception.mount();
    walk(f, "frame", perception.surface_frame());
    const MountFound found{mount.roll_rad(), mount.pitch_rad(), mount.x_m(), mount.height_m(), mount.tilt_sigma_rad()};
    walk(f, "mount", found);
  } else if (row == kMapRow) {
    walk(f, "map", perception.map_snapshot());
  } else if (row == kFootholdsRow) {
    const FootholdSet& footholds = published_in(module.link().footholds, cycle_ns);
    walk(f, "footholds", footholds);
  }
}

// One of everything that a recording has: of the header, the calls of ports and the rows' outputs. For f of names
// alone.
template <class... Messages>
void walk_messages(auto& f) {
  (walk(f, "", *std::make_unique<const Messages>()), ...);
}
void walk_recorded(auto& f) {
  walk_messages<CameraIntrinsics, GainLimits, ImuSample, JointFeedback, LioSample, JointCommand, hal::JointBusStatus>(
      f);
  constexpr JointSet kTaken;
  walk(f, "taken", kTaken);
  walk_messages<StateEstimate, EstimateQuality, GaitStatus, FootholdSet, SurfaceFrame, MountFound, MapSnapshot,
                PoseRequest>(f);
  constexpr OperatorRequest kRequest;
  walk(f, "request", kRequest);
  constexpr ModuleState kState{};
  walk(f, "module_state", kState);
  walk_health(f, HealthCounts{});
}

// What is written most, and has no vector: PlainWriter would not compile.
template <class T>
concept Fixed = (Of<T, StateEstimate> || Of<T, EstimateQuality> || Of<T, GaitStatus> || Of<T, ImuSample> ||
                 Of<T, JointFeedback> || Of<T, JointCommand> || Of<T, hal::JointBusStatus> || Of<T, LioSample> ||
                 Of<T, EdgeLine> || Of<T, OccupiedCell> || Of<T, Foothold> || Of<T, TreadView>);

// Where there is room: a number costs its copy, to a place that the compiler knows.
class PlainWriter {
 public:
  explicit PlainWriter(std::byte* at) noexcept : at_(at) {}
  template <Number T>
  void leaf(std::string_view, int, T value) noexcept {
    leaves(std::span<const T>(&value, 1));
  }
  template <Number T, std::size_t N>
  void leaves(std::span<T, N> values) noexcept {
    std::memcpy(at_, values.data(), values.size_bytes());
    at_ += values.size_bytes();
  }
  void enter(std::string_view, int) noexcept {}
  void leave() noexcept {}
  [[nodiscard]] std::byte* at() const noexcept { return at_; }

 private:
  std::byte* at_;
};

// Into the rest of a ByteWriter's memory, whose size it has brought up to date when it ends: within a cycle a number
// costs a comparison and a store.
class FieldWriter {
 public:
  // last_raised: Health::raised() as it was when it was written last; null where there is none to be written.
  FieldWriter(ByteWriter& out, std::uint32_t* last_raised) noexcept
      : out_(out), at_(out.rest().data()), left_(out.rest().size()), last_raised_(last_raised) {}
  FieldWriter(const FieldWriter&) = delete;
  FieldWriter& operator=(const FieldWriter&) = delete;
  ~FieldWriter() { is_full_ ? out_.set_full() : out_.advance(out_.rest().size() - left_); }
  template <Number T>
  void leaf(std::string_view, int, T value) noexcept {
    put(&value, sizeof value);
  }
  template <Number T>
  void leaves(std::span<T> values) noexcept {
    put(values.data(), values.size_bytes());
  }
  // Its fields take no more than it does: there is room for all of them, or for none.
  template <Fixed T>
  void whole(T& message) noexcept {
    if (sizeof message > left_) {
      is_full_ = true;
      return;
    }
    PlainWriter plain(at_);
    each_field(plain, message);
    left_ -= static_cast<std::size_t>(plain.at() - at_);
    at_ = plain.at();
  }
  void enter(std::string_view, int) noexcept {}
  void leave() noexcept {}
  std::size_t count(std::size_t n) noexcept {
    leaf("", -1, static_cast<std::uint32_t>(n));
    return n;
  }
  void health(const Health& health) noexcept {
    const bool changed = health.raised() != *last_raised_;
    leaf("", -1, changed);
    if (!changed) return;
    *last_raised_ = health.raised();
    walk_health(*this, counts_of(health));
  }

 private:
  void put(const void* bytes, std::size_t count) noexcept {
    if (count > left_) {
      is_full_ = true;
      return;
    }
    std::memcpy(at_, bytes, count);
    at_ += count;
    left_ -= count;
  }

  ByteWriter& out_;
  std::byte* at_;
  std::size_t left_;
  bool is_full_ = false;
  std::uint32_t* last_raised_;
};

// All of it is there afterwards.
void write_fields(ByteWriter& out, auto&& write) noexcept {
  FieldWriter writer(out, nullptr);
  write(writer);
}

class FieldReader {
 public:
  explicit FieldReader(ByteReader& in) noexcept : in_(in) {}
  template <Number T>
  void leaf(std::string_view, int, T& value) noexcept {
    value = in_.get<T>();
  }
  template <Number T>
  void leaves(std::span<T> values) noexcept {
    if constexpr (std::is_same_v<T, bool>) {
      for (T& value : values) value = in_.get<T>();
    } else {
      const std::span<const std::byte> bytes = in_.get_bytes(values.size_bytes());
      if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    }
  }
  void enter(std::string_view, int) noexcept {}
  void leave() noexcept {}
  template <class T, std::size_t Capacity>
  void resize(StaticVector<T, Capacity>& vector) noexcept {
    const auto count = in_.get<std::uint32_t>();
    if (count > Capacity) in_.fail();
    vector.clear();
    T none{};
    if constexpr (detail::kIsMatrix<T>) none.setZero();  // Eigen leaves it unset
    for (std::size_t i = 0; i < count && !in_.failed(); ++i) (void)vector.try_push_back(none);
  }

 private:
  ByteReader& in_;
};

// Bits and value of both sides: "0x3ff0000000000000 (1)".
template <Number T>
[[nodiscard]] std::string text_of_number(T value) {
  char text[80];
  if constexpr (std::is_floating_point_v<T>) {
    std::snprintf(text, sizeof text, "0x%016llx (%.17g)",
                  static_cast<unsigned long long>(std::bit_cast<std::uint64_t>(value)), value);
  } else if constexpr (std::is_signed_v<T>) {
    std::snprintf(text, sizeof text, "0x%llx (%lld)",
                  static_cast<unsigned long long>(static_cast<std::make_unsigned_t<T>>(value)),
                  static_cast<long long>(value));
  } else {
    std::snprintf(text, sizeof text, "0x%llx (%llu)", static_cast<unsigned long long>(value),
                  static_cast<unsigned long long>(value));
  }
  return text;
}

// Computed values against recorded bytes, bit by bit. Says where the first one differs; after two counts that differ
// nothing more can be compared.
class FieldComparer {
 public:
  FieldComparer(ByteReader& in, HealthCounts* last_health) noexcept : in_(in), last_health_(last_health) {}

  template <Number T>
  void leaf(std::string_view name, int index, const T& computed) {
    if (stopped_) return;
    if constexpr (std::is_same_v<T, bool> || std::is_enum_v<T>) {
      compare(name, index, in_.get<std::uint8_t>(), static_cast<std::uint8_t>(computed));
    } else {
      compare(name, index, in_.get<T>(), computed);
    }
  }
  void enter(std::string_view name, int index) noexcept {
    if (depth_ < path_.size()) path_[depth_] = {name, index};
    ++depth_;
  }
  void leave() noexcept { --depth_; }
  std::size_t count(std::size_t computed) {
    if (stopped_) return 0;
    const auto recorded = in_.get<std::uint32_t>();
    compare("size", -1, recorded, static_cast<std::uint32_t>(computed));
    stopped_ = stopped_ || recorded != computed;
    return stopped_ ? 0 : computed;
  }
  void health(const Health& health) {
    const HealthCounts computed = counts_of(health);
    if (in_.get<bool>()) {
      FieldReader reader(in_);
      for (EventCount& recorded : *last_health_) walk(reader, "", recorded);
    }
    if (in_.failed()) return;
    std::array<std::byte, sizeof(HealthCounts)> memory;
    ByteWriter bytes(memory);
    write_fields(bytes, [this](FieldWriter& writer) { walk_health(writer, *last_health_); });
    ByteReader recorded(bytes.bytes());
    FieldComparer of_health(recorded, nullptr);
    walk_health(of_health, computed);
    if (difference_.empty()) difference_ = of_health.difference_;
  }

  template <Number T>
  void compare(std::string_view name, int index, T recorded, T computed) {
    if (in_.failed()) stopped_ = true;
    if (stopped_ || std::memcmp(&recorded, &computed, sizeof(T)) == 0 || !difference_.empty()) return;
    difference_ =
        path(name, index) + ": recorded " + text_of_number(recorded) + ", computed " + text_of_number(computed);
  }
  // Empty, or the first one's field, recorded and computed value.
  [[nodiscard]] const std::string& difference() const noexcept { return difference_; }
  // Two counts differed: what follows in the record was not read.
  [[nodiscard]] bool stopped() const noexcept { return stopped_; }

 private:
  struct Step {
    std::string_view name;
    int index = -1;
  };
  [[nodiscard]] std::string path(std::string_view name, int index) const {
    std::string text;
    const auto add = [&text](const Step& step) {
      if (!text.empty() && !step.name.empty()) text += '.';
      text += step.name;
      if (step.index >= 0) text.append("[").append(std::to_string(step.index)).append("]");
    };
    for (std::size_t i = 0; i < std::min(depth_, path_.size()); ++i) add(path_[i]);
    add({name, index});
    return text;
  }

  ByteReader& in_;
  HealthCounts* last_health_;
  std::array<Step, 12> path_{};
  std::size_t depth_ = 0;
  bool stopped_ = false;
  std::string difference_;
};

}  // namespace polygmap::recording
