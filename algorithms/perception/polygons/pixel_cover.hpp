// SPDX-License-Identifier: Apache-2.0
// Whose pixels a convex polygon in the picture covers, and the straight cut that rids it best of what is not its own.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/polygons/convex_outline.hpp"
#include "algorithms/perception/regions/region.hpp"

namespace polygmap {

class PixelCover {
 public:
  struct Params {
    std::int32_t foreign_cost = 4;  // a smaller polygon is safe, one over a hole is not (2026-11)
    std::int32_t neighbours = 3;

    static void visit(auto& p, auto& field) {
      field("foreign_cost", p.foreign_cost, 1, 100,
            "A cut that rids a polygon of another surface's pixel may cost as many of its own.");
      field("neighbours", p.neighbours, 0, 6,
            "A cut is tried where the plane meets those of as many neighbours, the ones with most pixels in the "
            "polygon.");
    }
  };
  // apart_m: seen this far behind the plane, a pixel shows something else. work: counts what is done.
  PixelCover(const Params& params, const FrameImage& picture, const Regions& regions, RegionId id, double apart_m,
             WorkCount& work) noexcept
      : params_(params), picture_(picture), regions_(regions), id_(id), apart_m_(apart_m), work_(work) {}

  struct Count {
    std::int32_t own = 0, foreign = 0;
  };
  // Of a grid's pixels within the polygon, whose corners are half-resolution pixels.
  [[nodiscard]] Count count(const Outline2& polygon) const noexcept;
  struct Sides {
    std::int32_t positive = 0, negative = 0;
  };
  // A line in the picture is where line . ray = 0. How many of the surface's pixels lie on either side of it.
  [[nodiscard]] Sides own_by_side(const Outline2& polygon, const Vec3& line) const noexcept;
  // The line whose positive side keeps most of the surface's pixels and least of others': where a neighbour's plane
  // meets this one, or a column or a row of the picture. Not worth it where every cut costs more than it rids of.
  struct Cut {
    Vec3 line = Vec3::Zero();
    std::int32_t total = 0, best = 0;  // worth of the whole polygon, and of what the line keeps
    std::int32_t tried = 0;            // neighbours
    std::array<std::int32_t, Regions::kMaxRegions + 1> votes{};
    [[nodiscard]] bool worth_it() const noexcept { return best > total; }
  };
  // Columns and rows; then one neighbour after the other, until there is none left to try.
  void begin_cut(const Outline2& polygon, Cut& cut) const noexcept;
  [[nodiscard]] bool try_neighbour(const Outline2& polygon, Cut& cut) const noexcept;

 private:
  enum class Owner : std::uint8_t { kNobody, kOwn, kForeign };
  [[nodiscard]] Owner owner_of(std::int32_t column, std::int32_t row) const noexcept;
  // visit(column, row, whether its own) for those that have an owner.
  template <typename Visit>
  void for_each_pixel(const Outline2& polygon, const Visit& visit) const noexcept;
  // Of the pixels on the line's positive side: its own are to be kept, the others to be cut off.
  [[nodiscard]] std::int32_t worth_beyond(const Outline2& polygon, const Vec3& line) const noexcept;
  [[nodiscard]] Vec3 ray_of(std::int32_t column, std::int32_t row) const noexcept;

  Params params_;
  const FrameImage& picture_;
  const Regions& regions_;
  RegionId id_;
  double apart_m_;
  WorkCount& work_;
};

}  // namespace polygmap
