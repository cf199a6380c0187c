// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_extractor.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "algorithms/perception/regions/pixel_labels.hpp"

namespace polygmap {
namespace {

constexpr std::int32_t kMinSide_px = 32;
constexpr double kStepLeast_m = 0.01;  // a neighbour's centre is this far above or below to count as such

bool finite(const LegShapes& s) noexcept {
  return math::all_finite(s.thigh.a_m) && math::all_finite(s.thigh.b_m) && std::isfinite(s.thigh.radius_m) &&
         math::all_finite(s.shank.a_m) && math::all_finite(s.shank.b_m) && std::isfinite(s.shank.radius_m) &&
         math::all_finite(s.foot.centre.R) && math::all_finite(s.foot.centre.p_m) && math::all_finite(s.foot.half_m);
}

bool usable(const CameraIntrinsics& k) noexcept {
  const auto positive = [](double x) { return x >= 1.0 && x <= 1e5; };
  return k.width_px >= kMinSide_px && k.width_px <= kDepthWidth_px && k.height_px >= kMinSide_px &&
         k.height_px <= kDepthHeight_px && k.width_px % 2 == 0 && k.height_px % 2 == 0 && positive(k.fx_px) &&
         positive(k.fy_px) && std::abs(k.cx_px) <= 1e5 && std::abs(k.cy_px) <= 1e5 && k.depth_unit_m >= 1e-6 &&
         k.depth_unit_m <= 0.1;
}

}  // namespace

bool SurfaceExtractor::try_begin(const DepthFrameView& frame, const View& view) noexcept {
  if (busy()) {
    ++counters_.busy;
    return false;
  }
  const double up_norm = view.camera_up.norm();
  if (!usable(view.intrinsics) || !(std::abs(up_norm - 1.0) < 0.01) || !(view.body_margin.fixed_m >= 0.0) ||
      !(view.body_margin.fixed_m < 0.5) || !(view.body_margin.turn_rad >= 0.0) || !(view.body_margin.turn_rad < 0.5) ||
      !finite(view.body[0]) || !finite(view.body[1])) {
    ++counters_.bad_view;
    return false;
  }
  if (frame.depth == nullptr || frame.width_px != view.intrinsics.width_px ||
      frame.height_px != view.intrinsics.height_px) {
    ++counters_.bad_frame;
    return false;
  }
  if (any_frame_ && frame.stamp_ns <= last_stamp_ns_) {
    ++counters_.bad_order;
    return false;
  }
  any_frame_ = true;
  last_stamp_ns_ = frame.stamp_ns;
  ++counters_.frames;
  view_ = view;
  view_.camera_up /= up_norm;
  polygons_.configure(params_.polygons);
  picture_.rays.set(view.intrinsics);
  picture_.any_body = false;
  raw_.depth = frame.depth;
  raw_.intrinsics = view.intrinsics;
  raw_.range.set(params_.limits, view.intrinsics.depth_unit_m);
  picture_.column_rays.set(view.intrinsics);
  noise_ = depth_noise_.of(params_.noise);
  runs_.begin(params_.runs, noise_, view.intrinsics, picture_.columns);
  self_filter_.clear();
  next().stamp_ns = frame.stamp_ns;
  next().sequence = frame.sequence;
  next().surfaces.clear();
  next().dropped = 0;
  measured_px_ = outside_body_px_ = 0;
  planes_.count = 0;
  round_ = 0;
  units_spent_ = 0;
  enter(Phase::kMask);
  return true;
}

Progress SurfaceExtractor::step(WorkBudget& budget) noexcept {
  if (!busy()) return Progress::kIdle;
  while (!budget.exhausted()) {
    const std::int32_t units = run_piece();
    budget.spend(units);
    units_spent_ += units;
    if (!busy()) return Progress::kDone;
  }
  return Progress::kBusy;
}

void SurfaceExtractor::enter(Phase phase) noexcept {
  phase_ = phase;
  row_ = 0;
  index_ = 0;
  started_ = false;
}

std::int32_t SurfaceExtractor::run_piece() noexcept {
  switch (phase_) {
    case Phase::kIdle:
      return 1;
    case Phase::kMask:
      self_filter_.add_shape(picture_.rays, view_.body, view_.body_margin, index_);
      if (++index_ == SelfFilter::kShapes) enter(Phase::kReduce);
      return kMaxPieceUnits;
    case Phase::kReduce:
      reduce_row();
      if (++row_ == picture_.column_rays.height_px) {
        runs_.finish();
        counters_.run_overflow += runs_.overflow();
        if (measured_px_ == 0) {
          ++counters_.blank_frames;
          picture_.owners.fill(0);
          enter(Phase::kFinish);
        } else {
          growing_.begin(params_.growing, noise_, picture_.column_rays, runs_.columns());
          enter(Phase::kGrow);
        }
        return kMaxPieceUnits;
      }
      return 1;
    case Phase::kGrow:
      if (growing_.step()) {
        take_grown_planes();
        enter(Phase::kGather);
        return kMaxPieceUnits;
      }
      return 1;
    case Phase::kGather:
      boundaries_.gather(row_, runs_.columns()[static_cast<std::size_t>(row_)], to_plane_);
      if (round_ == 1) boundaries_.trim(row_);
      if (++row_ == picture_.column_rays.columns) enter(round_ == 0 ? Phase::kMeet : Phase::kClaim);
      return 1;
    case Phase::kClaim: {  // from left to right and back
      const std::int32_t last = picture_.column_rays.columns - 1, g = row_ <= last ? row_ : 2 * last + 1 - row_;
      boundaries_.claim(g, row_ <= last ? g - 1 : g + 1, row_ <= last ? first_found_ : planes_.count + 1,
                        planes_.count);
      if (++row_ == 2 * picture_.column_rays.columns) enter(Phase::kMeet);
      return 1;
    }
    case Phase::kMeet:
      if (row_ == 0) boundaries_.begin_meeting();
      boundaries_.meet(row_, round_ == 0);
      if (++row_ == picture_.column_rays.columns) {
        boundaries_.settle();
        enter(Phase::kRefit);
      }
      return 1;
    case Phase::kRefit:
      // Round 0 sharpens the grown planes, round 1 measures them within their final boundaries.
      if (row_ == 0) boundaries_.begin_refit();
      boundaries_.refit(row_, round_ == 0);
      row_ += SpanBoundaries::kRefitColumns;
      if (row_ >= picture_.column_rays.columns) {
        solve_planes();
        if (round_ == 0) {
          merge_planes(true);
          merging_.begin_facets(params_.merging, params_.growing, noise_, planes_);
        } else {
          boundaries_.follow();
        }
        enter(round_ == 0 ? Phase::kFacets : Phase::kPieces);
        ++round_;
        return kMaxPieceUnits;
      }
      return 8;
    case Phase::kFacets:
      return facet_step();
    case Phase::kSplit:
      return split_step();
    case Phase::kSearch:
      if (row_ == 0) begin_search();
      search_.add_column(picture_.column_rays, picture_.columns, row_,
                         boundaries_.columns()[static_cast<std::size_t>(row_)]);
      if (++row_ == picture_.column_rays.columns) {
        take_found_planes();
        enter(Phase::kGather);
        return kMaxPieceUnits;
      }
      return 1;
    case Phase::kPieces:
      pieces_step();
      return kMaxPieceUnits;
    case Phase::kProfile:
      profiles_.add_column(boundaries_.columns(), pieces_, row_, picture_);
      if (++row_ == picture_.column_rays.columns) {
        enter(Phase::kEvidence);
        index_ = 1;
      }
      return 1;
    case Phase::kEvidence:
      return evidence_step();
    case Phase::kSides:
      return side_step();
    case Phase::kOutline:
      outline();
      return 5;
    case Phase::kNosing:
      return line_step(true);
    case Phase::kBack:
      return line_step(false);
    case Phase::kPolygon: {
      build_polygon();
      const std::size_t next = index_ + 1;
      enter(Phase::kSides);
      index_ = next;
      return 10;
    }
    case Phase::kFinish:
      finish();
      enter(Phase::kIdle);
      return 1;
  }
  return 1;
}

void SurfaceExtractor::reduce_row() noexcept {
  std::uint8_t* flags = picture_.flags.row(row_ / 2);
  if (row_ % 2 == 0) {
    const bool marked = self_filter_.try_mark_row(row_ / 2, picture_.rays.width_px, flags);
    picture_.body_rows[static_cast<std::size_t>(row_ / 2)] = marked;
    picture_.any_body = picture_.any_body || marked;
  }
  const bool body = picture_.body_rows[static_cast<std::size_t>(row_ / 2)];
  constexpr std::int32_t kLater = 2;  // rows
  const std::int32_t columns = picture_.column_rays.columns, last = picture_.column_rays.height_px - 1;
  const ReducedRow reduced = reduce_to_columns(
      raw_.range, raw_.row(row_), body ? flags : nullptr, columns, picture_.columns.inverse_depth.row(row_),
      picture_.columns.valid.row(row_), raw_.row(std::min(row_ + kLater, last)));
  measured_px_ += reduced.measured_px;
  outside_body_px_ += kColumn_px * (columns - reduced.body_columns);
  constexpr std::int32_t kBlock = ScanlineSegmentation::kBlock;
  if (row_ % kBlock == kBlock - 1 || row_ + 1 == picture_.column_rays.height_px) {
    static_assert(kBlock % ColumnImage::kTurn == 0);
    picture_.columns.turn(row_ - row_ % kBlock, row_);
    runs_.add_rows(row_ - row_ % kBlock, row_);
  }
}

std::size_t SurfaceExtractor::surface_at(std::int32_t column, std::int32_t row,
                                         const std::uint16_t* depth) const noexcept {
  if (column / kColumn_px >= picture_.column_rays.columns) return 0;
  RawImage raw = raw_;
  raw.depth = depth;
  return planes_[pixel_label(picture_, raw, noise_, planes_, column, row)].surface;
}

void SurfaceExtractor::pieces_step() noexcept {
  if (!started_) {
    counters_.run_overflow += boundaries_.overflow();
    pieces_.find(boundaries_.columns(), picture_.column_rays.columns);
    started_ = true;
    return;
  }
  counters_.run_overflow += pieces_.overflow();
  counters_.plane_overflow += pieces_.join(params_.pieces, boundaries_, picture_, planes_);
  profiles_.begin(planes_);
  side_finder_.begin(params_.sides, noise_, raw_, picture_, planes_);
  enter(Phase::kProfile);
}

// Large surfaces are wider than what columns mix.
std::int32_t SurfaceExtractor::evidence_step() noexcept {
  if (index_ > planes_.count) {
    enter(Phase::kSides);
    index_ = 1;
    return 1;
  }
  const std::size_t i = index_++;
  FramePlane& plane = planes_[i];
  if (!plane.alive || plane.piece_px > params_.evidence_px) return 1;
  if (inlier_ratio(picture_, raw_, noise_, plane, i, profiles_[i]) < params_.min_evidence) plane.alive = false;
  return 3;
}

// One side of one surface at a time.
std::int32_t SurfaceExtractor::side_step() noexcept {
  if (index_ > planes_.count) {
    enter(Phase::kFinish);
    return 1;
  }
  if (!planes_[index_].alive) {
    ++index_;
    return 1;
  }
  if (!started_) side_finder_.find_ends(index_, profiles_[index_]);
  (started_ ? sides_.right : sides_.left) = side_finder_.find(index_, profiles_[index_], started_);
  if (started_) phase_ = Phase::kOutline;
  started_ = !started_;
  return 4;
}

void SurfaceExtractor::outline() noexcept {
  column_outline_.build(profiles_[index_], sides_, kMaxPolygonVertices - 4, outline_);
  lines_ = SurfaceLines{};
  phase_ = planes_[index_].kind == SurfaceKind::kTread ? Phase::kNosing : Phase::kPolygon;
}

// Gathers where the surface ends in each column and what lies beyond; false when there is too little to look for.
bool SurfaceExtractor::begin_line(bool nosing) noexcept {
  constexpr std::int32_t kProbe_px = 8;
  // Per column: the plane beyond, 0 where there is none, or the body or the picture's end hides it.
  std::array<std::uint8_t, kColumns> beyond{};
  std::array<std::int32_t, PlaneSet::kMaxPlanes + 1> votes{};
  const std::int32_t down = nosing ? 1 : -1;
  const ColumnExtents& profile = profiles_[index_];
  const auto end_of = [&](std::int32_t g) -> std::int32_t {
    const ColumnExtent& ends = profile.columns[static_cast<std::size_t>(g)];
    return nosing ? ends.bottom : ends.top;
  };
  for (std::int32_t g = profile.first_column; g <= profile.last_column; ++g) {
    const std::int32_t end = end_of(g), far = end + down * kProbe_px;
    if (end < 0 || far < 0 || far >= picture_.column_rays.height_px || picture_.body(kColumn_px / 2 * g, far / 2))
      continue;
    // The first owner from the end on: rows lie next to one another.
    static_assert(kProbe_px == sizeof(std::uint64_t) && std::endian::native == std::endian::little);
    std::uint64_t owners = 0;
    std::memcpy(&owners, picture_.owners.row(g) + std::min(end + down, far), sizeof(owners));
    const int first_bit = nosing ? std::countr_zero(owners) : 63 - std::countl_zero(owners);
    const auto found = static_cast<std::uint8_t>(owners != 0 ? owners >> (first_bit & ~7) : 0U);
    beyond[static_cast<std::size_t>(g)] = found;
    ++votes[found];
  }
  // The plane beyond: most columns, and on the right side of the surface (a nosing has it below, a back line above).
  // Above, a riser is the back; without one, a higher tread whose nosing hides the rest of this surface.
  const FramePlane& own = planes_[index_];
  const auto most = [&](bool riser_only) {
    std::size_t other = 0;
    for (std::size_t p = 1; p <= planes_.count; ++p) {
      if (2 * votes[p] < params_.edge_lines.min_columns || p == index_ || !planes_[p].alive) continue;
      const double height = own.plane.distance_m(planes_[p].centre_m);
      if (nosing ? height > -kStepLeast_m : height < kStepLeast_m) continue;
      if (riser_only && planes_[p].kind != SurfaceKind::kRiser) continue;
      if (other == 0 || votes[p] > votes[other]) other = p;
    }
    return other;
  };
  const std::size_t riser = nosing ? 0 : most(true);
  const std::size_t other = riser != 0 ? riser : most(false);
  if (other == 0) return false;
  line_finder_.begin_guess();
  for (std::int32_t g = profile.first_column; g <= profile.last_column; ++g) {
    if (beyond[static_cast<std::size_t>(g)] == other) line_finder_.add_guess(g, end_of(g));
  }
  if (!line_finder_.try_guess(params_.edge_lines, static_cast<std::uint32_t>(index_))) {
    ++counters_.rejected_lines;
    return false;
  }
  const EdgeLineFinder::Measured near_side{own.plane, own.covariance};
  const EdgeLineFinder::Measured far_side{planes_[other].plane, planes_[other].covariance};
  line_finder_.begin(params_.edge_lines, noise_, view_.intrinsics, picture_.column_rays, picture_.columns, near_side,
                     &far_side, nosing);
  if (!nosing && riser == 0) {
    lines_.occluder = line_finder_.guessed_line();
    return false;
  }
  return true;
}

std::int32_t SurfaceExtractor::line_step(bool nosing) noexcept {
  const auto leave = [&] {
    started_ = false;
    phase_ = nosing ? Phase::kBack : Phase::kPolygon;
  };
  if (!started_) {
    if (!begin_line(nosing)) {
      leave();
      return 5;
    }
    started_ = true;
    return 20;
  }
  if (!line_finder_.step(kColumnsPerPiece)) return 12;
  EdgeLine line;
  const EdgeLineFinder::Outcome outcome = line_finder_.finish(line);
  if (outcome == EdgeLineFinder::Outcome::kAgain) return 20;
  counters_.rejected_lines += outcome == EdgeLineFinder::Outcome::kFound ? 0U : 1U;
  (nosing ? lines_.nosing : lines_.back) = line;
  leave();
  return 20;
}

void SurfaceExtractor::build_polygon() noexcept {
  FramePlane& own = planes_[index_];
  SurfacePatch patch;
  if (!polygons_.try_build(picture_, planes_, index_, profiles_[index_], outline_, lines_, patch)) {
    own.alive = false;
    ++counters_.no_polygon;
    return;
  }
  if (!next().surfaces.try_push_back(patch)) {
    ++next().dropped;
    ++counters_.plane_overflow;
    own.alive = false;
    return;
  }
  own.surface = static_cast<std::uint8_t>(next().surfaces.size());
  own.nosing = lines_.nosing;
}

void SurfaceExtractor::finish() noexcept {
  if (measured_px_ > 0) depth_noise_.follow(params_.depth_noise, params_.noise, boundaries_.noise_samples());
  next().invalid_fraction = outside_body_px_ > 0 ? 1.0 - static_cast<double>(measured_px_) / outside_body_px_ : 1.0;
  done_ = 1 - done_;
  raw_.depth = nullptr;  // the driver's again
}

}  // namespace polygmap
