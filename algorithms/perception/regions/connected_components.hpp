// SPDX-License-Identifier: Apache-2.0
// The connected pieces of every plane's pixels, and which of them are one surface.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/perception/planes/plane_set.hpp"
#include "algorithms/perception/planes/span_boundaries.hpp"

namespace polygmap {

class ConnectedComponents {
 public:
  struct Params {
    double apart_m = 0.04;
    std::int32_t min_component_px = 160;
    std::int32_t min_surface_px = 440;
    std::int32_t min_other_px = 1500;

    static void visit(auto& p, auto& field) {
      field("apart_m", p.apart_m, 0.001, 0.5, "What is seen as far from a plane is something else.");
      field("min_component_px", p.min_component_px, 1, 100000, "A piece of a surface has as many pixels.");
      field("min_surface_px", p.min_surface_px, 1, 100000,
            "A tread that meets a riser, or the reverse, has as many pixels.");
      field("min_other_px", p.min_other_px, 1, 100000,
            "Any other surface has as many pixels: curved things have facets of this size.");
    }
  };

  // Numbers the pieces that the planes' spans form, and writes each span's number into it: 0 for those without room.
  void find(SpanBoundaries::Columns& columns, std::int32_t column_count) noexcept;
  // Gives every piece a plane, and planes without enough of them up. Returns how many surfaces found no room.
  std::uint32_t join(const Params& params, const SpanBoundaries& boundaries, const FrameImage& picture,
                     PlaneSet& planes) noexcept;
  // Of a piece, after join: a plane that is kept, 0 = none.
  [[nodiscard]] std::uint8_t plane_of(std::uint16_t piece) const noexcept { return pieces_[piece].plane; }
  // Pieces that found no room.
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }

 private:
  static constexpr std::size_t kMaxPieces = 255;
  struct Piece {             // a connected piece of a plane's pixels
    std::uint8_t plane = 0;  // 1-based; 0: dropped
    double area_px = 0.0;
    double sum_column = 0.0, sum_row = 0.0;                 // half resolution
    std::int32_t left = 0, right = 0, top = 0, bottom = 0;  // columns and rows, inclusive
  };
  [[nodiscard]] static bool apart(double apart_m, const FrameImage& picture, const Piece& a, const Piece& b,
                                  const InversePlane& plane) noexcept;
  // Of the surfaces of one fitted plane, that of the nearest which the piece belongs to; 0 = none.
  [[nodiscard]] std::uint8_t same_plane(const FrameImage& picture, const PlaneSet& planes, const Piece& piece,
                                        std::uint8_t source) const noexcept;

  std::array<Piece, kMaxPieces + 1> pieces_{};
  std::size_t piece_count_ = 0;
  // Union-find over all intervals.
  std::array<std::uint16_t, static_cast<std::size_t>(kColumns) * SpanBoundaries::kMaxIntervals + 1> parent_{};
  std::uint32_t overflow_ = 0;
};

}  // namespace polygmap
