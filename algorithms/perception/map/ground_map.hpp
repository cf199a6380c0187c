// SPDX-License-Identifier: Apache-2.0
// How high the ground is, square by square of the map's frame, where pictures showed it: a polygon is convex and may
// have a hole in it, and what was never seen is no ground.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/ground_view.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/geometry/convex.hpp"
#include "algorithms/geometry/plan_frame.hpp"
#include "algorithms/perception/image/column_image.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

class GroundMap {
 public:
  struct Params {
    double level_m = 0.025;
    double tall_m = 0.06;
    double range_m = 2.2;
    double beside_m = 0.05;
    double start_m = 0.35;
    double own_m = 0.06;
    std::int32_t sightings = 2;

    static void visit(auto& p, auto& field) {
      field("level_m", p.level_m, 0.002, 0.1, "Ground as near to the height of the standing soles is level with them.");
      field("tall_m", p.tall_m, 0.01, 0.5, "What is higher above the standing soles rises from the ground.");
      field.ordered("level_m", "tall_m");
      field("range_m", p.range_m, 0.3, 10.0, "Farther from the camera nothing is looked at.");
      field("beside_m", p.beside_m, 0.0, 0.2,
            "Ground that was never seen is level as near to a sole that stands, which hides it.");
      field("start_m", p.start_m, 0.0, 1.0,
            "Where it is met, ground is taken to be level as near to its soles, until it is seen.");
      field("own_m", p.own_m, 0.0, 0.3, "What is seen as near to a foot, or above it, may be the robot's own.");
      field("sightings", p.sightings, 1, 7, "A square counts once it was seen as often at one height.");
    }
  };
  struct View {
    Transform map_T_camera;  // at the exposure
    CameraIntrinsics intrinsics;
    const ColumnImage* columns = nullptr;  // the picture; none: nothing is seen
    std::uint32_t number = 0;              // pictures of different numbers are looked at in different pixels
    std::array<Transform, kFootCount> map_T_sole{};
    std::array<bool, kFootCount> stands{};
    SoleRectangle sole{};
  };

  explicit GroundMap(const Params& params) noexcept : params_(params) {}
  void clear() noexcept {
    cells_.fill({});
    has_begun_ = false;
  }

  // One frame: begin, look until it is true, and, where it is to be told, tell until it is true.
  void begin(const View& view) noexcept;
  [[nodiscard]] bool look() noexcept;
  [[nodiscard]] bool tell(GroundView& out) noexcept;
  // What lies within the outline, x and y of its own frame, between it and where its plane comes to the height of the
  // standing soles, or two squares about that, is not level, where some of it is about as high as they are. An outline
  // that lies between the middle lines of two rows is missed.
  [[gnu::cold, gnu::noinline]] void leave_out(const Transform& map_T_local, const ConvexPolygon& local,
                                              GroundView& out) noexcept;
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  static constexpr std::int32_t kSide_cells = 128;  // of the square of cells, which repeats
  static constexpr std::int32_t kRowStep = 96, kColumnStep = 2;
  static constexpr std::uint8_t kMostCount = 7;
  struct Cell {
    std::int16_t x = 0, y = 0;
    std::int16_t height_mm = 0;
    std::uint8_t count = 0;  // of sightings for its height, less those against
  };

  [[nodiscard]] Cell& at(std::int32_t x, std::int32_t y) noexcept {
    const auto within = [](std::int32_t i) { return static_cast<std::size_t>(i & (kSide_cells - 1)); };
    return cells_[within(y) * kSide_cells + within(x)];
  }
  [[nodiscard]] bool knows(const Cell& cell, std::int32_t x, std::int32_t y) const noexcept {
    return cell.x == x && cell.y == y && cell.count > 0;
  }
  [[nodiscard]] bool is_at_a_gap(std::int32_t column) const noexcept;
  void see(const Vec3& map_p_m) noexcept;
  void look_through(const Vec3& map_p_m) noexcept;
  void tell_row(GroundView& out) noexcept;
  // Of a cell; what is outside the view is left out.
  void set(GroundView::Rows& rows, std::int32_t x, std::int32_t y) const noexcept;
  void close(GroundView::Rows& level, bool bridges) noexcept;
  void stand_on(std::size_t foot, double grown_m, std::int32_t count) noexcept;
  // visit(x, y) for the cells whose middles are within the sole, grown by so much on all sides.
  void each_cell_under(std::size_t foot, double grown_m, auto&& visit) const noexcept;

  Params params_;
  View view_;
  std::array<PlanFrame, kFootCount> soles_;
  std::int32_t row_ = 0;        // of the picture, then of what is told
  std::int32_t height_mm_ = 0;  // of the standing soles
  std::array<Cell, static_cast<std::size_t>(kSide_cells) * kSide_cells> cells_{};
  std::int32_t first_x_ = 0, first_y_ = 0;  // cell (0, 0) of the view
  GroundView::Rows own_{};                  // at and beside the robot's own feet, wherever they are
  GroundView::Rows lower_{}, higher_{};     // of what is told: ground of another height was seen there
  bool has_begun_ = false;
  WorkCount work_;
};

}  // namespace polygmap
