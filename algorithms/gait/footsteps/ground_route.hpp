// SPDX-License-Identifier: Apache-2.0
// The way to a place over ground that was seen, round what rises and round where no ground was found.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/messages/ground_view.hpp"

namespace polygmap {

struct GroundRouteParams {
  double thing_m = 0.36;
  double brink_m = 0.28;
  double ahead_m = 0.80;
  double reached_m = 0.25;
  std::int32_t waves_per_tick = 2;

  static void visit(auto& p, auto& field) {
    field("thing_m", p.thing_m, 0.0, 1.0, "The middle between the feet keeps as far from what rises, where it can.");
    field("brink_m", p.brink_m, 0.0, 1.0, "It keeps as far from where it looked and saw no level ground.");
    field("ahead_m", p.ahead_m, 0.1, 2.0,
          "What rises farther from the robot may be stairs: only from nearer by the search tells.");
    field("reached_m", p.reached_m, 0.05, 1.0, "As near to the place where a way turns it looks for the way on.");
    field("waves_per_tick", p.waves_per_tick, 1, 1000, "Rings of squares that one tick of the control goes on by.");
  }
};

class GroundRoute {
 public:
  enum class Way : std::uint8_t { kUnknown, kStraight, kRound, kShut };

  // In the squares of the view.
  struct Barred {
    GroundView::Rows unseen{};  // it looked there and saw no level ground
    GroundView::Rows tried{};   // it stood there and came no further
    GroundView::Rows walked{};  // it was there on its way round: a way back there counts double
  };

  // from, to: odometry, as the view's corner. Step until it is no longer busy; the way found before holds until then,
  // and longer where it is round and still clear.
  void begin(const GroundRouteParams& params, const GroundView& ground, const Barred& barred, const Vec2& from_m,
             const Vec2& to_m) noexcept;
  void step(const GroundRouteParams& params) noexcept;
  void clear() noexcept { is_busy_ = false, way_ = Way::kUnknown; }
  [[nodiscard]] bool is_busy() const noexcept { return is_busy_; }
  [[nodiscard]] Way way() const noexcept { return way_; }
  // Where the way is round: its farthest place that lies in a straight line.
  [[nodiscard]] const Vec2& via_m() const noexcept { return via_m_; }

 private:
  using Rows = GroundView::Rows;
  static constexpr std::int32_t kSide = GroundView::kSide_cells;
  static constexpr std::uint8_t kNever = 255;
  struct Cell {
    std::int32_t x = 0, y = 0;
  };

  [[nodiscard]] Cell cell_at(const Vec2& odom_p_m) const noexcept;
  [[nodiscard]] Vec2 middle_m(const Cell& cell) const noexcept;
  [[nodiscard]] std::uint8_t& time(std::int32_t x, std::int32_t y) noexcept {
    return time_[static_cast<std::size_t>(y * kSide + x)];
  }
  [[nodiscard]] bool is_clear(const Vec2& a_m, const Vec2& b_m) const noexcept;
  void sow(const Vec2& to_m) noexcept;
  void wave() noexcept;
  void follow() noexcept;

  bool is_busy_ = false;
  Way way_ = Way::kUnknown;
  Vec2 corner_m_ = Vec2::Zero(), from_m_ = Vec2::Zero(), via_m_ = Vec2::Zero();
  Cell start_;
  Rows shut_{};     // no way leads there
  Rows dear_{};     // a way that leads there counts double: it was never seen, or walked on
  Rows reached_{};  // by a wave that starts at the goal
  Rows front_{}, late_{};
  std::uint8_t now_ = 0;
  bool inside_ = false;  // the goal is where no way leads, as on top of stairs: the wave begins at the nearest square
  std::array<std::uint8_t, 4 * static_cast<std::size_t>(kSide)>
      edge_time_{};  // when the wave comes in there, from beyond
  std::array<std::uint8_t, static_cast<std::size_t>(kSide) * kSide> time_{};  // when it was there
};

}  // namespace polygmap
