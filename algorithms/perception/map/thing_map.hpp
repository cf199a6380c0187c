// SPDX-License-Identifier: Apache-2.0
// Where things lie on treads: squares of ground in the map's frame that pictures showed to be occupied, remembered
// while they are out of view, and given up once the ground there is seen to be free again.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/column_image.hpp"

namespace polygmap {

// What the map keeps about one square of ground.
struct ThingCell {
  std::int32_t x = 0, y = 0;  // in cells
  double ground_m = 0.0, height_m = 0.0;
  std::int32_t count = 0;
  bool seen = false;      // in this frame
  bool occupied = false;  // as it was told last
  [[nodiscard]] Vec3 at(double above_m) const noexcept {
    return {(x + 0.5) * kOccupiedCell_m, (y + 0.5) * kOccupiedCell_m, ground_m + above_m};
  }
};

class ThingMap {
 public:
  struct Params {
    std::int32_t seen = 3;
    std::int32_t most = 30;
    std::int32_t occupied = 12;
    double free_share = 0.4;
    double range_m = 1.3;

    static void visit(auto& p, auto& field) {
      field("seen", p.seen, 1, 100, "A picture that shows a thing on a cell counts as many as this that show it free.");
      field("most", p.most, 1, 100, "The count of a cell grows no further.");
      field("occupied", p.occupied, 1, 100, "From this count on a cell is occupied; it stays so down to half of it.");
      field.ordered("occupied", "most");
      field("free_share", p.free_share, 0.05, 0.9,
            "A cell is seen free where what the picture shows in the middle of the thing is lower than this share of "
            "it.");
      field("range_m", p.range_m, 0.1, 10.0, "Farther from the camera a cell is not seen free.");
    }
  };
  struct View {
    Transform map_T_camera;  // at the exposure
    CameraIntrinsics intrinsics;
    const ColumnImage* columns = nullptr;  // the picture; none: nothing is seen free
  };

  explicit ThingMap(const Params& params) noexcept : params_(params) {}
  void clear() noexcept;

  // One frame: begin, add for each of its sightings, look_again for each cell from 0 to count, finish.
  void begin(const View& view) noexcept;
  void add(const ThingSighting& sighting) noexcept;
  [[nodiscard]] std::size_t count() const noexcept { return cells_.size(); }
  void look_again(std::size_t cell) noexcept;
  void finish(OccupiedCells& occupied) noexcept;
  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  static constexpr std::int32_t kSide = 128;  // of the square of cells, which repeats
  using Index = std::uint8_t;                 // 1 + that of a cell, 0: none
  static_assert(kMaxOccupiedCells < 255);

  [[nodiscard]] Index& index_of(std::int32_t x, std::int32_t y) noexcept {
    const auto within = [](std::int32_t i) { return static_cast<std::size_t>(i & (kSide - 1)); };
    return index_[within(y) * kSide + within(x)];
  }
  void mark(const Vec3& ground_p_m, double height_m) noexcept;
  [[nodiscard]] ThingCell* cell_for(std::int32_t x, std::int32_t y) noexcept;
  [[nodiscard]] bool seen_free(const ThingCell& cell) const noexcept;

  Params params_;
  View view_;
  Transform camera_T_map_;
  StaticVector<ThingCell, kMaxOccupiedCells> cells_;
  std::array<Index, static_cast<std::size_t>(kSide) * kSide> index_{};
  bool may_make_room_ = true;  // in this frame
  WorkCount work_;
};

}  // namespace polygmap
