// SPDX-License-Identifier: Apache-2.0
// The module at a glance, as a person who watches it wants to have it: one value for the table, the lines and the JSON
// of `polygmap climb --watch` and `polygmapd --watch`. It is made of the mailbox's sections alone.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/mailbox/mailbox_layout.hpp"

namespace polygmap {

// Sections of one moment, and what they are read with.
struct MailboxImage {
  bool is_virtual = false;    // stamps are a simulation's
  std::int64_t epoch_ns = 0;  // time 0 of the view, on the stamps' clock
  bool has_names = false;
  polygmap_mailbox_names names{};
  polygmap_mailbox_status status{};
  polygmap_mailbox_timing timing{};
  polygmap_mailbox_events events{};
};

// What is not a number is not known: no run yet, or no work is counted.
struct LiveCost {
  double mean_us = std::numeric_limits<double>::quiet_NaN();
  double worst_us = std::numeric_limits<double>::quiet_NaN();
  double mean_slack_us = std::numeric_limits<double>::quiet_NaN();
  double worst_slack_us = std::numeric_limits<double>::quiet_NaN();
};
struct LiveRow {
  std::string name;
  double budget_us = 0.0;
  LiveCost robot, host;  // see polygmap_mailbox_row
  std::uint64_t runs = 0, overruns = 0, shed = 0;
};

struct LiveFoothold {
  std::array<double, 3> odom_p_sole_m{};
  double odom_yaw_rad = 0.0, margin_m = 0.0;
  double toe_margin_m = 0.0;  // infinite where no riser is mapped
  std::uint32_t polygon = 0;
};

using LiveEvents = std::vector<std::pair<std::string, std::uint32_t>>;
struct LiveView {
  bool is_virtual = false;
  double time_s = 0.0;
  std::string state, phase, stop_reason, waits_for;
  std::uint32_t treads = 0;
  struct {
    std::uint32_t number = 0;  // 0: none yet
    bool is_right = false, onto_tread = false;
  } step;
  std::uint64_t cycles = 0, cycle_overruns = 0, skipped_cycles = 0;
  double cycles_per_s = 0.0;  // of the wall clock; NaN: not known yet
  double speed = 1.0;         // seconds of the view's clock in one of the wall's; NaN likewise
  double asked_speed = 0.0;   // 0: as fast as it can
  std::vector<LiveRow> rows;  // in the schedule's order
  std::size_t worst_row = 0;  // by its worst slack against its budget; rows.size(): none
  double picture_age_s = 0.0, map_age_s = 0.0, lio_age_s = 0.0;  // NaN: there is none yet
  std::array<std::optional<LiveFoothold>, 2> next;               // of left and right foot
  std::string no_way;                                            // why there is no next foothold; "none"
  LiveEvents faults, limits;                                     // raised ones alone
  [[nodiscard]] bool is_too_slow() const noexcept { return speed < 0.97 * asked_speed; }
};

// Makes views of images, and knows how fast they follow each other.
class LiveMeter {
 public:
  // asked_speed: see LiveView.
  explicit LiveMeter(double asked_speed = 0.0) noexcept : asked_speed_(asked_speed) {}
  // now_ns: on the stamps' clock, for ages. wall_ns: CLOCK_MONOTONIC.
  [[nodiscard]] LiveView view(const MailboxImage& image, std::int64_t now_ns, std::int64_t wall_ns);

 private:
  struct Mark {
    std::int64_t wall_ns, stamp_ns;
    std::uint64_t cycles;
  };
  double asked_speed_;
  std::deque<Mark> marks_;  // of the last two seconds
};

}  // namespace polygmap
