// SPDX-License-Identifier: Apache-2.0
// Which surfaces the robot stood on, how near its body came to the world, and whether it stands where it was to go.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/truth.hpp"

namespace polygmap::sim {

struct RouteFigures {
  std::optional<bool> goal_reached;                                   // none: the world has no goal
  double goal_distance_m = std::numeric_limits<double>::quiet_NaN();  // from the middle of the soles, at the end
  std::vector<std::string> surfaces_stood_on;  // in order, each as often as a foot came to it from another one
  std::string stood_on_wrongly;                // the first that is not to be stood on; empty: none
  // From the first surface that it came to, to the last one, in the mean; of fewer than two: none.
  double seconds_per_surface = std::numeric_limits<double>::quiet_NaN();
  double body_clearance_min_m = std::numeric_limits<double>::quiet_NaN();  // torso, thighs, shanks to the solids
};

class RouteReport {
 public:
  static constexpr double kGoalWithin_m = 0.25, kGoalWithin_rad = kPi / 12.0;
  static constexpr std::int64_t kRest_ns = 50 * kNsPerMs;  // a sole that stands this long rests

  explicit RouteReport(const StairWorld& world) : world_(world), solids_(solids_of(world)) {}

  void observe(const Truth& truth);
  // It is sent on, to there: the goal is reached by who was at the first one and comes to this one.
  void send_on(const WorldPlace& goal);
  [[nodiscard]] RouteFigures figures() const;

 private:
  static constexpr int kNowhere = -100;
  [[nodiscard]] std::string name_of(int step) const;
  void observe_body(const Truth& truth);
  [[nodiscard]] double distance_m(const WorldPlace& goal) const;
  [[nodiscard]] bool is_at_goal(const WorldPlace& goal) const;

  StairWorld world_;
  std::vector<SolidBox> solids_;
  Truth last_;
  bool was_at_goal_ = true;  // at the one before this
  std::uint64_t ticks_ = 0;
  std::array<std::int64_t, kFootCount> stands_since_ns_{-1, -1};
  std::array<int, kFootCount> rests_on_{kNowhere, kNowhere};
  std::vector<int> stood_on_;
  std::int64_t first_came_ns_ = -1, last_came_ns_ = -1;  // to another surface than where it began
  double body_clearance_m_ = std::numeric_limits<double>::infinity();
};

}  // namespace polygmap::sim
