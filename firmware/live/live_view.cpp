// SPDX-License-Identifier: Apache-2.0
#include "firmware/live/live_view.hpp"

#include <algorithm>
#include <span>

namespace polygmap {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t kWindow_ns = 2'000'000'000;
constexpr std::uint32_t kFirstLimit = 100;  // numbers above are limits

std::string text_of(const polygmap_mailbox_name& name) {
  const char* const end = std::find(std::begin(name.text), std::end(name.text), '\0');
  return {std::begin(name.text), end};
}
template <std::size_t Most>
std::string name_of(const polygmap_mailbox_name (&names)[Most], std::uint32_t number) {
  const std::string name = number < Most ? text_of(names[number]) : std::string();
  return name.empty() ? "unknown" : name;
}

double age_s(std::int64_t stamp_ns, std::int64_t now_ns) {
  return stamp_ns == 0 ? kUnknown : 1e-9 * static_cast<double>(now_ns - stamp_ns);
}

LiveCost cost_of(const polygmap_mailbox_cost& from, std::uint64_t runs) {
  if (runs == 0 || from.most_ns == 0) return {};
  const double mean_us = 1e-3 / static_cast<double>(runs);
  return {mean_us * static_cast<double>(from.total_ns), 1e-3 * static_cast<double>(from.most_ns),
          mean_us * static_cast<double>(from.total_slack_ns), 1e-3 * static_cast<double>(from.least_slack_ns)};
}

void put_rows(LiveView& view, const MailboxImage& image) {
  const std::size_t count = std::min<std::size_t>(image.timing.row_count, POLYGMAP_MAILBOX_ROWS);
  double least_share = std::numeric_limits<double>::infinity();
  view.worst_row = count;
  for (std::size_t i = 0; i < count; ++i) {
    const polygmap_mailbox_row& from = image.timing.rows[i];
    LiveRow row;
    row.name = text_of(image.names.rows[i]);
    row.budget_us = image.names.row_budgets_us[i];
    row.robot = cost_of(from.robot, from.runs);
    row.host = cost_of(from.host, from.runs);
    row.runs = from.runs;
    row.overruns = from.overruns;
    row.shed = from.shed;
    const double share = row.robot.worst_slack_us / row.budget_us;
    if (share < least_share) {
      least_share = share;
      view.worst_row = i;
    }
    view.rows.push_back(std::move(row));
  }
  for (const polygmap_mailbox_lane& lane : image.timing.lanes) {
    view.cycle_overruns += lane.overruns;
    view.skipped_cycles += lane.skipped;
  }
}

}  // namespace

LiveView LiveMeter::view(const MailboxImage& image, std::int64_t now_ns, std::int64_t wall_ns) {
  const polygmap_mailbox_status& status = image.status;
  LiveView view;
  view.is_virtual = image.is_virtual;
  view.time_s = 1e-9 * static_cast<double>(now_ns - image.epoch_ns);
  view.state = name_of(image.names.module_states, status.module_state);
  view.phase = name_of(image.names.gait_phases, status.gait_phase);
  view.stop_reason = name_of(image.names.stop_reasons, status.stop_reason);
  view.waits_for = name_of(image.names.arming_waits, status.arming_wait);
  view.treads = status.treads_climbed;
  view.step.number = status.step_sequence;
  view.step.is_right = status.step_foot == 1;
  view.step.onto_tread = status.step_onto_tread != 0;
  view.cycles = status.cycles;
  put_rows(view, image);
  view.picture_age_s = age_s(status.picture_stamp_ns, now_ns);
  view.map_age_s = age_s(status.map_stamp_ns, now_ns);
  view.lio_age_s = age_s(status.lio_stamp_ns, now_ns);
  for (std::size_t foot = 0; foot < view.next.size(); ++foot) {
    const polygmap_mailbox_foothold& from = status.next[foot];
    if (from.valid == 0) continue;
    LiveFoothold& next = view.next[foot].emplace();
    std::ranges::copy(from.odom_p_sole_m, next.odom_p_sole_m.begin());
    next.odom_yaw_rad = from.odom_yaw_rad;
    next.margin_m = from.clearance_m;
    next.toe_margin_m = from.toe_clearance_m;
    next.polygon = from.polygon_id;
  }
  view.no_way = name_of(image.names.stop_reasons, status.way_reason);
  for (std::size_t i = 0; i < POLYGMAP_MAILBOX_EVENTS; ++i) {
    if (image.events.count[i] == 0) continue;
    auto& list = image.names.event_numbers[i] < kFirstLimit ? view.faults : view.limits;
    list.emplace_back(text_of(image.names.events[i]), image.events.count[i]);
  }

  // Anew where the clock or the count went back: that is another run.
  const bool is_another = !marks_.empty() && (status.cycles < marks_.back().cycles || now_ns < marks_.back().stamp_ns);
  if (is_another) marks_.clear();
  while (marks_.size() > 1 && wall_ns - marks_[1].wall_ns >= kWindow_ns) marks_.pop_front();
  marks_.push_back({wall_ns, now_ns, status.cycles});
  const double wall_s = 1e-9 * static_cast<double>(wall_ns - marks_.front().wall_ns);
  const double virtual_s = 1e-9 * static_cast<double>(now_ns - marks_.front().stamp_ns);
  view.cycles_per_s = wall_s > 0.0 ? static_cast<double>(status.cycles - marks_.front().cycles) / wall_s : kUnknown;
  view.speed = wall_s > 0.0 ? virtual_s / wall_s : kUnknown;
  view.asked_speed = asked_speed_;
  return view;
}

}  // namespace polygmap
