// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_builder.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace polygmap {
namespace {

constexpr std::int32_t kColumnsPerPiece = 16;  // that are searched for a line

}  // namespace

void SurfaceBuilder::begin(const Params& params, const DepthNoiseModel& noise, const RawImage& raw,
                           const FrameImage& image, Regions& regions, SurfaceFrame& frame) noexcept {
  params_ = params;
  noise_ = noise;
  raw_ = &raw;
  image_ = &image;
  regions_ = &regions;
  frame_ = &frame;
  id_ = 1;
  begun_ = false;
  std::fill_n(published_.begin(), regions.count + 1, PublishedSurface{});
  counts_ = Counts{};
  side_lines_.begin(params_.sides, noise_, raw, image, regions);
  polygons_.configure(params_.polygons);
  part_ = Part::kSideLeft;
}

Progress SurfaceBuilder::step(WorkBudget& budget) noexcept {
  while (part_ != Part::kDone && !budget.exhausted()) {
    do_piece();
    budget.spend(take_units());
  }
  return part_ == Part::kDone ? Progress::kDone : Progress::kBusy;
}

std::int32_t SurfaceBuilder::take_units() noexcept {
  for (WorkCount* part : {&side_lines_.work(), &column_outline_.work(), &edge_lines_.work(), &polygons_.work()}) {
    work_.add(*part);
  }
  work_.add(150);
  return work_.take_units();
}

void SurfaceBuilder::do_piece() noexcept {
  switch (part_) {
    case Part::kSideLeft:
      return find_left_side();
    case Part::kSideRight:
      return find_right_side();
    case Part::kOutline:
      return build_outline();
    case Part::kNosing:
      return find_line(Edge::kNosing);
    case Part::kBack:
      return find_line(Edge::kBack);
    case Part::kPolygon:
      return build_polygon();
    case Part::kDone:
      return;
  }
}

void SurfaceBuilder::find_left_side() noexcept {
  if (id_ > regions_->count) {
    part_ = Part::kDone;
    return;
  }
  if (!(*regions_)[id_].alive) {
    ++id_;
    return;
  }
  side_lines_.find_ends(id_);
  sides_.left = side_lines_.find(id_, false);
  part_ = Part::kSideRight;
}

void SurfaceBuilder::find_right_side() noexcept {
  sides_.right = side_lines_.find(id_, true);
  part_ = Part::kOutline;
}

void SurfaceBuilder::build_outline() noexcept {
  column_outline_.build(regions_->extents[id_], sides_, params_.corner_px, kMaxPolygonVertices - 4, outline_);
  lines_ = SurfaceLines{};
  begun_ = false;
  part_ = (*regions_)[id_].kind == SurfaceKind::kTread ? Part::kNosing : Part::kPolygon;
}

void SurfaceBuilder::look_beyond(Edge edge, Beyond& beyond) noexcept {
  constexpr std::int32_t kProbe_px = 8;  // labels in one word
  const std::int32_t down = edge == Edge::kNosing ? 1 : -1;
  const ColumnExtents& extents = regions_->extents[id_];
  work_.add(300 + 40 * (extents.last_column - extents.first_column + 1));
  for (std::int32_t g = extents.first_column; g <= extents.last_column; ++g) {
    const std::int32_t end = end_of(edge, g), far = end + down * kProbe_px;
    if (end < 0) continue;
    const bool outside = far < 0 || far >= image_->column_rays.height_px;
    if (!outside && image_->body(kColumn_px / 2 * g, far / 2)) continue;
    ++beyond.all_columns;
    if (outside) continue;
    // The first label from the end on: rows lie next to one another.
    static_assert(kProbe_px == sizeof(std::uint64_t) && std::endian::native == std::endian::little);
    std::uint64_t labels = 0;
    std::memcpy(&labels, regions_->labels.column(g) + std::min(end + down, far), sizeof(labels));
    const int first_bit = edge == Edge::kNosing ? std::countr_zero(labels) : 63 - std::countl_zero(labels);
    const auto found = static_cast<RegionId>(labels != 0 ? labels >> (first_bit & ~7) : 0U);
    beyond.region[static_cast<std::size_t>(g)] = found;
    ++beyond.columns[found];
  }
}

// In most columns, of those that lie so against the surface.
RegionId SurfaceBuilder::most_beyond(Edge edge, const Beyond& beyond, Lies lies) const noexcept {
  const Regions& regions = *regions_;
  const InversePlane& plane = regions[id_].plane;
  RegionId most = kNoRegion;
  for (RegionId p = 1; p <= regions.count; ++p) {
    if (2 * beyond.columns[p] < params_.edge_lines.min_columns || p == id_ || !regions[p].alive) continue;
    // The foot of a post is no end of a tread.
    if (edge == Edge::kBack && beyond.columns[p] < params_.least_back_share * beyond.all_columns) continue;
    const double height_m = plane.distance_m(regions[p].centre_m);
    if (lies == Lies::kBelow ? height_m > -params_.least_step_m : height_m < params_.least_step_m) continue;
    if (lies == Lies::kAboveUpright && regions[p].kind != SurfaceKind::kRiser) continue;
    if (most == kNoRegion || beyond.columns[p] > beyond.columns[most]) most = p;
  }
  return most;
}

bool SurfaceBuilder::begin_line(Edge edge) noexcept {
  work_.add(3 * regions_->count * 12);
  Beyond beyond;
  look_beyond(edge, beyond);
  // A nosing has something below. At the back a riser is the end; without one, a higher tread whose nosing hides the
  // rest of this surface; without either, the edge where it drops away from the viewer.
  const RegionId riser = edge == Edge::kNosing ? kNoRegion : most_beyond(edge, beyond, Lies::kAboveUpright);
  const RegionId higher =
      edge == Edge::kNosing || riser != kNoRegion ? kNoRegion : most_beyond(edge, beyond, Lies::kAbove);
  const bool drops = riser == kNoRegion && higher == kNoRegion;
  const RegionId other = drops ? most_beyond(edge, beyond, Lies::kBelow) : riser != kNoRegion ? riser : higher;
  if (other == kNoRegion) return false;
  const ColumnExtents& extents = regions_->extents[id_];
  work_.add(12 * (extents.last_column - extents.first_column + 1));
  edge_lines_.begin_guess();
  for (std::int32_t g = extents.first_column; g <= extents.last_column; ++g) {
    if (beyond.region[static_cast<std::size_t>(g)] == other) edge_lines_.add_guess(g, end_of(edge, g));
  }
  if (!edge_lines_.try_guess(params_.edge_lines, id_)) {
    ++counts_.rejected_lines;
    return false;
  }
  const Region &own = (*regions_)[id_], &far = (*regions_)[other];
  const EdgeLineFinder::Measured near_side{own.plane, own.covariance}, far_side{far.plane, far.covariance};
  work_.add(900);
  lines_.back_drops = edge == Edge::kBack && drops;
  using Kind = EdgeLineFinder::Kind;
  const Kind kind = edge == Edge::kNosing ? Kind::kNosing : drops ? Kind::kLip : Kind::kBack;
  edge_lines_.begin(params_.edge_lines, noise_, raw_->intrinsics, image_->column_rays, image_->columns, near_side,
                    &far_side, kind);
  if (higher != kNoRegion) {
    lines_.occluder = edge_lines_.guessed_line();
    return false;
  }
  return true;
}

void SurfaceBuilder::find_line(Edge edge) noexcept {
  const Part next = edge == Edge::kNosing ? Part::kBack : Part::kPolygon;
  if (!begun_) {
    begun_ = begin_line(edge);
    if (!begun_) part_ = next;
    return;
  }
  if (!edge_lines_.step(kColumnsPerPiece)) return;
  EdgeLine line;
  const EdgeLineFinder::Outcome outcome = edge_lines_.finish(line);
  if (outcome == EdgeLineFinder::Outcome::kAgain) return;
  counts_.rejected_lines += outcome == EdgeLineFinder::Outcome::kFound ? 0U : 1U;
  (edge == Edge::kNosing ? lines_.nosing : lines_.back) = line;
  begun_ = false;
  part_ = next;
}

void SurfaceBuilder::build_polygon() noexcept {
  if (!begun_) {
    polygons_.begin(*image_, *regions_, id_, outline_, lines_, frame_->surfaces);
    first_patch_ = static_cast<std::uint8_t>(frame_->surfaces.size() + 1);
    begun_ = true;
    return;
  }
  if (!polygons_.step()) return;
  const PolygonBuilder::Built& built = polygons_.built();
  frame_->dropped += static_cast<std::uint32_t>(built.without_room);
  counts_.overflow += static_cast<std::uint32_t>(built.without_room);
  if (built.pieces > 0) {
    published_[id_] = {first_patch_, lines_.nosing};
  } else {
    (*regions_)[id_].alive = false;
    counts_.no_polygon += built.without_room == 0 ? 1U : 0U;
  }
  ++id_;
  begun_ = false;
  part_ = Part::kSideLeft;
}

}  // namespace polygmap
