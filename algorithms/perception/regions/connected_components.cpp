// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/connected_components.hpp"

#include <algorithm>

namespace polygmap {
namespace {

// A tread that meets a riser, or a riser that meets a tread.
bool on_a_step(const SpanBoundaries& boundaries, const PlaneSet& planes, const FramePlane& plane) noexcept {
  constexpr double kLeastColumns = 2.0;
  bool found = false;
  if (plane.kind == SurfaceKind::kOther) return false;
  const SurfaceKind wanted = plane.kind == SurfaceKind::kTread ? SurfaceKind::kRiser : SurfaceKind::kTread;
  boundaries.for_each_meeting(plane.source, [&](std::uint8_t other, double columns) {
    found = found || (columns >= kLeastColumns && planes[other].kind == wanted && planes[other].alive);
  });
  return found;
}

}  // namespace

// Intervals of one plane that share rows in neighbouring columns hang together. Pieces come out by area.
void ConnectedComponents::find(SpanBoundaries::Columns& columns, std::int32_t column_count) noexcept {
  overflow_ = 0;
  const auto root = [this](std::uint16_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  };
  std::uint16_t count = 0;
  for (std::int32_t g = 0; g < column_count; ++g) {
    std::size_t next = 0;  // on the left, the first span that ends no higher than this one begins
    for (ColumnSpan& span : columns[static_cast<std::size_t>(g)]) {
      span.component = ++count;
      parent_[count] = count;
      if (g == 0) continue;
      const SpanBoundaries::Column& lefts = columns[static_cast<std::size_t>(g - 1)];
      while (next < lefts.size() && lefts[next].bottom < span.top) ++next;
      for (std::size_t i = next; i < lefts.size() && lefts[i].top <= span.bottom; ++i) {
        const ColumnSpan& left = lefts[i];
        if ((static_cast<int>(left.plane == span.plane) & static_cast<int>(left.bottom >= span.top)) == 0) continue;
        const std::uint16_t a = root(left.component), b = root(span.component);
        parent_[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  // Roots are numbered in the order of the picture; parent_ then holds the pieces' numbers, 0 for those without room.
  piece_count_ = 0;
  for (std::uint16_t i = 1; i <= count; ++i) {
    if (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];  // a root comes before its members and has its number by now
      continue;
    }
    parent_[i] = 0;
    if (piece_count_ == kMaxPieces) {
      ++overflow_;
      continue;
    }
    pieces_[++piece_count_] = Piece{};
    parent_[i] = static_cast<std::uint16_t>(piece_count_);
  }
  for (std::int32_t g = 0; g < column_count; ++g) {
    for (ColumnSpan& span : columns[static_cast<std::size_t>(g)]) {
      span.component = parent_[span.component];
      if (span.component == 0) continue;
      Piece& piece = pieces_[span.component];
      if (piece.area_px == 0.0) {
        piece.left = g;
        piece.top = span.top;
      }
      piece.right = g;
      piece.top = std::min<std::int32_t>(piece.top, span.top);
      piece.bottom = std::max<std::int32_t>(piece.bottom, span.bottom);
      const double area_px = kColumn_px * (span.bottom - span.top + 1);
      piece.plane = span.plane;
      piece.area_px += area_px;
      piece.sum_column += area_px * (0.5 * kColumn_px * g + 0.25 * kColumn_px - 0.5);
      piece.sum_row += area_px * 0.25 * (span.top + span.bottom);
    }
  }
}

// Two pieces belong together when nothing but missing data (the robot's leg, dropouts) or their own plane lies between.
// Something seen behind the plane is a hole; something in front of it hides what nobody knows.
bool ConnectedComponents::apart(double apart_m, const FrameImage& picture, const Piece& a, const Piece& b,
                                const InversePlane& plane) noexcept {
  constexpr int kProbes = 24;
  constexpr int kEnough = 3;
  const Vec2 from = Vec2{a.sum_column, a.sum_row} / a.area_px, to = Vec2{b.sum_column, b.sum_row} / b.area_px;
  int elsewhere = 0;
  for (int i = 0; i <= kProbes && elsewhere < kEnough; ++i) {
    const Vec2 p = from + (to - from) * (static_cast<double>(i) / kProbes);
    const auto c = static_cast<std::int32_t>(p.x() + 0.5), r = static_cast<std::int32_t>(p.y() + 0.5);
    const float w = picture.inverse_depth_at(c, r);
    if (!(w > 0.0F)) continue;
    const double expected = plane.inverse_depth(picture.rays.ray(c, r));
    elsewhere += expected > 1e-3 && std::abs(1.0 / static_cast<double>(w) - 1.0 / expected) > apart_m ? 1 : 0;
  }
  return elsewhere >= kEnough;
}

// That a piece is coplanar with others of a plane says little about one farther away than it is wide: another box of
// the same height, the wall below a table. One that leaves the picture may hang together outside.
std::uint8_t ConnectedComponents::same_plane(const FrameImage& picture, const PlaneSet& planes, const Piece& piece,
                                             std::uint8_t source) const noexcept {
  const bool leaves = piece.left == 0 || piece.top == 0 || piece.right + 1 == picture.column_rays.columns ||
                      piece.bottom + 1 == picture.column_rays.height_px;
  if (leaves) return source;
  double nearest2 = piece.area_px;
  std::uint8_t same = 0;
  for (std::size_t p = 1; p <= planes.count; ++p) {
    if (planes[p].source != source || planes[p].main_piece == 0) continue;
    const Piece& other = pieces_[planes[p].main_piece];
    const double across = kColumn_px * std::max({0, other.left - piece.right - 1, piece.left - other.right - 1});
    const double down = std::max({0, other.top - piece.bottom - 1, piece.top - other.bottom - 1});
    const double gap2 = across * across + down * down;
    if (gap2 >= nearest2) continue;
    nearest2 = gap2;
    same = planes[p].same;
  }
  return same;
}

// The largest piece of a plane keeps it. A piece apart from that becomes a surface of its own in the same plane.
std::uint32_t ConnectedComponents::join(const Params& params, const SpanBoundaries& boundaries,
                                        const FrameImage& picture, PlaneSet& planes) noexcept {
  std::uint32_t without_room = 0;
  const std::size_t fitted = planes.count;
  for (std::size_t p = 1; p <= fitted; ++p) {
    planes[p].source = static_cast<std::uint8_t>(p);
    planes[p].same = static_cast<std::uint8_t>(p);
    planes[p].main_piece = 0;
    planes[p].piece_px = 0.0;
  }
  StaticVector<std::uint8_t, kMaxPieces> order;
  for (std::size_t k = 1; k <= piece_count_; ++k) {
    if (pieces_[k].area_px < params.min_component_px || !planes[pieces_[k].plane].alive) {
      pieces_[k].plane = 0;
    } else {
      static_cast<void>(order.try_push_back(static_cast<std::uint8_t>(k)));
    }
  }
  std::sort(order.begin(), order.end(), [this](std::uint8_t a, std::uint8_t b) {
    return pieces_[a].area_px != pieces_[b].area_px ? pieces_[a].area_px > pieces_[b].area_px : a < b;
  });
  for (const std::uint8_t number : order) {
    Piece& piece = pieces_[number];
    const std::uint8_t source = piece.plane;
    piece.plane = 0;
    // The plane itself and those that pieces of it have become.
    for (std::size_t p = source; p <= planes.count && piece.plane == 0; p = p == source ? fitted + 1 : p + 1) {
      const FramePlane& plane = planes[p];
      if (plane.source != source) continue;
      if (plane.main_piece == 0 || !apart(params.apart_m, picture, pieces_[plane.main_piece], piece, plane.plane)) {
        piece.plane = static_cast<std::uint8_t>(p);
      }
    }
    if (piece.plane == 0) {
      if (piece.area_px < params.min_surface_px) continue;
      if (planes.count == PlaneSet::kMaxPlanes) {
        ++without_room;
        continue;
      }
      const std::uint8_t same = same_plane(picture, planes, piece, source);
      planes[++planes.count] = planes[source];
      planes[planes.count].same = same != 0 ? same : static_cast<std::uint8_t>(planes.count);
      planes[planes.count].main_piece = 0;
      planes[planes.count].piece_px = 0.0;
      piece.plane = static_cast<std::uint8_t>(planes.count);
    }
    FramePlane& plane = planes[piece.plane];
    if (plane.main_piece == 0) {
      plane.main_piece = number;
      const Vec3 ray = picture.rays.ray(piece.sum_column / piece.area_px, piece.sum_row / piece.area_px);
      if (plane.plane.inverse_depth(ray) > 1e-3) plane.centre_m = plane.plane.point(ray);
    }
    plane.piece_px += piece.area_px;
  }
  // All are judged by what all were, whatever their order.
  std::array<bool, PlaneSet::kMaxPlanes + 1> kept{};
  for (std::size_t p = 1; p <= planes.count; ++p) {
    const FramePlane& plane = planes[p];
    kept[p] = plane.alive && plane.piece_px >= params.min_surface_px &&
              (plane.piece_px >= params.min_other_px || on_a_step(boundaries, planes, plane));
  }
  for (std::size_t p = 1; p <= planes.count; ++p) planes[p].alive = kept[p];
  for (std::size_t k = 1; k <= piece_count_; ++k)
    pieces_[k].plane = kept[pieces_[k].plane] ? pieces_[k].plane : std::uint8_t{0};
  return without_room;
}

}  // namespace polygmap
