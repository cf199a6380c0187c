// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/surface_extractor.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "algorithms/perception/back_projection.hpp"

namespace polygmap {
namespace {

constexpr std::int32_t kMinSide_px = 32;
constexpr double kStepLeast_m = 0.01;  // a neighbour's centre is this far above or below to count as such
constexpr double kLeastSlope = 0.5;    // sine between a riser and the tread that ends it
constexpr double kOnLine_m = 0.002;    // a polygon's edge lies on a line

bool finite(const LegShapes& s) noexcept {
  return math::all_finite(s.thigh.a_m) && math::all_finite(s.thigh.b_m) && std::isfinite(s.thigh.radius_m) &&
         math::all_finite(s.shank.a_m) && math::all_finite(s.shank.b_m) && std::isfinite(s.shank.radius_m) &&
         math::all_finite(s.foot.centre.R) && math::all_finite(s.foot.centre.p_m) && math::all_finite(s.foot.half_m);
}

bool usable(const CameraIntrinsics& k) noexcept {
  const auto positive = [](double x) { return x > 1.0 && x < 1e5; };
  return k.width_px >= kMinSide_px && k.width_px <= kDepthWidth_px && k.height_px >= kMinSide_px &&
         k.height_px <= kDepthHeight_px && k.width_px % 2 == 0 && k.height_px % 2 == 0 && positive(k.fx_px) &&
         positive(k.fy_px) && std::abs(k.cx_px) < 1e5 && std::abs(k.cy_px) < 1e5 && k.depth_unit_m > 1e-6 &&
         k.depth_unit_m < 0.1;
}

SurfaceKind kind_of(const InversePlane& plane, const Vec3& up, double tilt_rad) noexcept {
  const double c = plane.normal().dot(up);
  if (c > math::cos(tilt_rad)) return SurfaceKind::kTread;
  if (std::abs(c) < math::sin(tilt_rad)) return SurfaceKind::kRiser;
  return SurfaceKind::kOther;
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
  for (std::int32_t r = 0; r < frame.height_px; ++r) {
    const std::uint16_t* source = frame.depth + static_cast<std::ptrdiff_t>(r) * frame.width_px;
    std::copy(source, source + frame.width_px, full_.row(r));
  }
  rays_.set(view.intrinsics);
  range_.set(params_.limits, view.intrinsics.depth_unit_m);
  column_rays_.set(view.intrinsics);
  noise_ = params_.noise.scaled(noise_scale_);
  runs_.begin(params_.runs, noise_, view.intrinsics, columns_);
  self_filter_.clear();
  next_.stamp_ns = frame.stamp_ns;
  next_.sequence = frame.sequence;
  next_.surfaces.clear();
  next_.dropped = 0;
  measured_px_ = outside_body_px_ = 0;
  plane_count_ = 0;
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
  repeat_ = 0;
  index_ = 0;
  started_ = false;
}

std::int32_t SurfaceExtractor::run_piece() noexcept {
  switch (phase_) {
    case Phase::kIdle:
      return 1;
    case Phase::kMask:
      self_filter_.add_shape(rays_, view_.body, view_.body_margin, index_);
      if (++index_ == SelfFilter::kShapes) enter(Phase::kReduce);
      return 20;
    case Phase::kReduce:
      reduce_row();
      if (++row_ == column_rays_.height_px) {
        runs_.finish();
        counters_.run_overflow += runs_.overflow();
        if (measured_px_ == 0) {
          ++counters_.blank_frames;
          enter(Phase::kFinish);
        } else {
          growing_.begin(params_.growing, noise_, column_rays_, runs_.columns());
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
      if (++row_ == column_rays_.columns) enter(round_ == 0 ? Phase::kMeet : Phase::kClaim);
      return 1;
    case Phase::kClaim: {  // from left to right and back
      const std::int32_t last = column_rays_.columns - 1, g = row_ <= last ? row_ : 2 * last + 1 - row_;
      boundaries_.claim(g, row_ <= last ? g - 1 : g + 1, first_found_, plane_count_);
      if (++row_ == 2 * column_rays_.columns) enter(Phase::kMeet);
      return 1;
    }
    case Phase::kMeet:
      if (row_ == 0) boundaries_.begin_meeting();
      boundaries_.meet(row_, round_ == 0);
      if (++row_ == column_rays_.columns) {
        boundaries_.settle();
        enter(Phase::kRefit);
      }
      return 1;
    case Phase::kRefit:
      // Round 0 sharpens the grown planes, round 1 measures them within their final boundaries.
      if (row_ == 0) boundaries_.begin_refit();
      boundaries_.refit(row_);
      row_ += SurfaceBoundaries::kRefitColumns;
      if (row_ >= column_rays_.columns) {
        solve_planes();
        if (round_ == 0) merge_planes();
        if (round_ == 1) boundaries_.follow();
        enter(round_ == 0 ? Phase::kSearch : Phase::kPieces);
        ++round_;
        return kMaxPieceUnits;
      }
      return 2;
    case Phase::kSearch:
      if (row_ == 0) begin_search();
      search_.add_column(column_rays_, columns_, row_, boundaries_.columns()[static_cast<std::size_t>(row_)]);
      if (++row_ == column_rays_.columns) {
        take_found_planes();
        enter(Phase::kGather);
        return kMaxPieceUnits;
      }
      return 1;
    case Phase::kPieces:
      counters_.run_overflow += boundaries_.overflow();
      find_pieces();
      join_pieces();
      begin_profile();
      enter(Phase::kProfile);
      return kMaxPieceUnits;
    case Phase::kProfile:
      profile(row_);
      if (++row_ == column_rays_.columns) {
        enter(Phase::kOutline);
        index_ = 1;
      }
      return 1;
    case Phase::kOutline:
      if (index_ > plane_count_) {
        enter(Phase::kFinish);
        return 1;
      }
      if (!planes_[index_].alive) {
        ++index_;
        return 1;
      }
      outline();
      return 20;
    case Phase::kNosing:
      return line_step(true);
    case Phase::kBack:
      return line_step(false);
    case Phase::kPolygon: {
      build_polygon();
      const std::size_t next = index_ + 1;
      enter(Phase::kOutline);
      index_ = next;
      return 20;
    }
    case Phase::kFinish:
      finish();
      enter(Phase::kIdle);
      return 1;
  }
  return 1;
}

void SurfaceExtractor::reduce_row() noexcept {
  std::uint8_t* flags = flags_.row(row_ / 2);
  if (row_ % 2 == 0) {
    std::fill(flags, flags + rays_.width_px, std::uint8_t{0});
    self_filter_.mark_row(row_ / 2, rays_.width_px, flags);
  }
  const std::int32_t columns = column_rays_.columns;
  const ReducedRow reduced = reduce_to_columns(range_, full_.row(row_), flags, columns,
                                               columns_.inverse_depth.row(row_), columns_.valid.row(row_));
  measured_px_ += reduced.measured_px;
  outside_body_px_ += kColumn_px * (columns - reduced.body_columns);
  runs_.add_row(row_);
}

void SurfaceExtractor::take_grown_planes() noexcept {
  boundaries_.begin(params_.boundaries, noise_, column_rays_, view_.intrinsics.fy_px, view_.intrinsics.cy_px, columns_);
  counters_.plane_overflow += growing_.overflow();
  to_plane_.fill(0);
  plane_count_ = std::min(growing_.count(), kMaxPlanes);
  for (std::size_t i = 1; i <= plane_count_; ++i) {
    const GrownPlane& grown = growing_.plane(i);
    Plane& p = planes_[i];
    p = Plane{};
    p.plane = grown.plane;
    p.kind = kind_of(grown.plane, view_.camera_up, params_.kind_tilt_rad);
    p.pixels = grown.pixels;
    p.alive = true;
    p.centre_m = grown.plane.point(grown.mean_ray);
    to_plane_[i] = static_cast<std::uint8_t>(i);
  }
  merge_planes();
  for (std::size_t i = 1; i <= plane_count_; ++i) boundaries_.plane(i).plane = planes_[i].plane;
}

// Pieces of one surface that a leg, a hole or noise has split share one plane: the larger one's.
void SurfaceExtractor::merge_planes() noexcept {
  for (std::size_t a = 1; a <= plane_count_; ++a) {
    for (std::size_t b = a + 1; b <= plane_count_ && planes_[a].alive; ++b) {
      if (!planes_[b].alive) continue;
      const std::size_t keep = planes_[a].pixels >= planes_[b].pixels ? a : b, gone = keep == a ? b : a;
      Plane &p = planes_[keep], &q = planes_[gone];
      const bool small = q.pixels < params_.small_plane_px;
      const double tilt_rad = params_.merge_tilt_rad * (small ? 2.0 : 1.0);
      if (p.plane.normal().dot(q.plane.normal()) < math::cos(tilt_rad)) continue;
      if (std::abs(p.plane.distance_m(q.centre_m)) > params_.merge_m) continue;
      if (!small && std::abs(q.plane.distance_m(p.centre_m)) > 2.0 * params_.merge_m) continue;
      p.pixels += q.pixels;
      q.alive = false;
      for (std::uint8_t& plane : to_plane_) plane = plane == gone ? static_cast<std::uint8_t>(keep) : plane;
    }
  }
}

void SurfaceExtractor::begin_search() noexcept {
  search_.begin(params_.remainder, view_.camera_up);
  for (std::size_t i = 1; i <= plane_count_; ++i) {
    const Plane& p = planes_[i];
    if (!p.alive) continue;
    if (p.kind == SurfaceKind::kTread) search_.know_level(p.plane);
    if (p.kind == SurfaceKind::kRiser) search_.know_upright(p.plane, p.pixels);
  }
}

void SurfaceExtractor::take_found_planes() noexcept {
  search_.finish();
  first_found_ = plane_count_ + 1;
  for (const InversePlane& found : search_.found()) {
    if (plane_count_ == kMaxPlanes) {
      ++counters_.plane_overflow;
      break;
    }
    Plane& p = planes_[++plane_count_];
    p = Plane{};
    p.plane = found;
    p.kind = kind_of(found, view_.camera_up, params_.kind_tilt_rad);
    p.alive = true;
    boundaries_.plane(plane_count_).plane = found;
  }
}

void SurfaceExtractor::solve_planes() noexcept {
  constexpr double kLeast_px = 64.0;
  for (std::size_t i = 1; i <= plane_count_; ++i) {
    Plane& p = planes_[i];
    if (!p.alive) continue;
    const SurfaceBoundaries::Plane& fitted = boundaries_.plane(i);
    p.moments = fitted.moments;
    p.residual2 = fitted.residual2;
    if (p.moments.count < kLeast_px ||
        !try_solve_leaning(params_.planes, noise_, p.moments, view_.camera_up, p.plane, &p.covariance)) {
      p.alive = false;
      for (std::uint8_t& plane : to_plane_) plane = plane == i ? std::uint8_t{0} : plane;
      continue;
    }
    p.kind = kind_of(p.plane, view_.camera_up, params_.kind_tilt_rad);
    p.pixels = p.moments.count;
    p.centre_m = p.plane.point(p.moments.mean_ray());
    boundaries_.plane(i).plane = p.plane;
  }
}

// Intervals of one plane that share rows in neighbouring columns hang together. Pieces come out by area.
void SurfaceExtractor::find_pieces() noexcept {
  SurfaceBoundaries::Columns& columns = boundaries_.columns();
  const auto root = [this](std::uint16_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  };
  std::uint16_t count = 0;
  for (std::int32_t g = 0; g < column_rays_.columns; ++g) {
    for (ColumnSpan& span : columns[static_cast<std::size_t>(g)]) {
      span.piece = ++count;
      parent_[count] = count;
      if (g == 0) continue;
      for (const ColumnSpan& left : columns[static_cast<std::size_t>(g - 1)]) {
        if (left.plane != span.plane || left.bottom < span.top || left.top > span.bottom) continue;
        const std::uint16_t a = root(left.piece), b = root(span.piece);
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
      ++counters_.run_overflow;
      continue;
    }
    pieces_[++piece_count_] = Piece{};
    parent_[i] = static_cast<std::uint16_t>(piece_count_);
  }
  for (std::int32_t g = 0; g < column_rays_.columns; ++g) {
    for (ColumnSpan& span : columns[static_cast<std::size_t>(g)]) {
      span.piece = parent_[span.piece];
      if (span.piece == 0) continue;
      Piece& piece = pieces_[span.piece];
      const double area_px = kColumn_px * (span.bottom - span.top + 1);
      piece.plane = span.plane;
      piece.area_px += area_px;
      piece.sum_column += area_px * (2.0 * g + 0.5);
      piece.sum_row += area_px * 0.25 * (span.top + span.bottom);
    }
  }
}

// Two pieces belong together when nothing but missing data (the robot's leg, dropouts) or their own plane lies between.
// Something seen behind the plane is a hole; something in front of it hides what nobody knows.
bool SurfaceExtractor::apart(const Piece& a, const Piece& b, const InversePlane& plane) const noexcept {
  constexpr int kProbes = 24;
  constexpr int kEnough = 3;
  const Vec2 from = Vec2{a.sum_column, a.sum_row} / a.area_px, to = Vec2{b.sum_column, b.sum_row} / b.area_px;
  int elsewhere = 0;
  for (int i = 0; i <= kProbes; ++i) {
    const Vec2 p = from + (to - from) * (static_cast<double>(i) / kProbes);
    const auto c = static_cast<std::int32_t>(p.x() + 0.5), r = static_cast<std::int32_t>(p.y() + 0.5);
    const float w = inverse_depth_at(c, r);
    if (!(w > 0.0F)) continue;
    const double expected = plane.inverse_depth(rays_.ray(c, r));
    elsewhere += expected > 1e-3 && std::abs(1.0 / static_cast<double>(w) - 1.0 / expected) > params_.apart_m ? 1 : 0;
  }
  return elsewhere >= kEnough;
}

// A tread that meets a riser, or a riser that meets a tread.
bool SurfaceExtractor::on_a_step(const Plane& plane) const noexcept {
  constexpr double kLeastColumns = 4.0;
  bool found = false;
  if (plane.kind == SurfaceKind::kOther) return false;
  const SurfaceKind wanted = plane.kind == SurfaceKind::kTread ? SurfaceKind::kRiser : SurfaceKind::kTread;
  boundaries_.for_each_meeting(plane.source, [&](std::uint8_t other, double columns) {
    found = found || (columns >= kLeastColumns && planes_[other].kind == wanted && planes_[other].alive);
  });
  return found;
}

// The largest piece of a plane keeps it. A piece apart from that becomes a surface of its own in the same plane.
void SurfaceExtractor::join_pieces() noexcept {
  const std::size_t fitted = plane_count_;
  for (std::size_t p = 1; p <= fitted; ++p) {
    planes_[p].source = static_cast<std::uint8_t>(p);
    planes_[p].main_piece = 0;
    planes_[p].piece_px = 0.0;
  }
  std::array<std::uint8_t, kMaxPieces + 1> order{};
  for (std::size_t k = 1; k <= piece_count_; ++k) order[k] = static_cast<std::uint8_t>(k);
  std::sort(order.begin() + 1, order.begin() + 1 + static_cast<std::ptrdiff_t>(piece_count_),
            [this](std::uint8_t a, std::uint8_t b) {
              return pieces_[a].area_px != pieces_[b].area_px ? pieces_[a].area_px > pieces_[b].area_px : a < b;
            });
  for (std::size_t i = 1; i <= piece_count_; ++i) {
    Piece& piece = pieces_[order[i]];
    const std::uint8_t source = piece.plane;
    piece.plane = 0;
    if (piece.area_px < params_.min_component_px || !planes_[source].alive) continue;
    for (std::size_t p = 1; p <= plane_count_ && piece.plane == 0; ++p) {
      const Plane& plane = planes_[p];
      if (plane.source != source) continue;
      if (plane.main_piece == 0 || !apart(pieces_[plane.main_piece], piece, plane.plane)) {
        piece.plane = static_cast<std::uint8_t>(p);
      }
    }
    if (piece.plane == 0) {
      if (piece.area_px < params_.min_surface_px) continue;
      if (plane_count_ == kMaxPlanes) {
        ++counters_.plane_overflow;
        continue;
      }
      planes_[++plane_count_] = planes_[source];
      planes_[plane_count_].main_piece = 0;
      planes_[plane_count_].piece_px = 0.0;
      piece.plane = static_cast<std::uint8_t>(plane_count_);
    }
    Plane& plane = planes_[piece.plane];
    if (plane.main_piece == 0) {
      plane.main_piece = order[i];
      const Vec3 ray = rays_.ray(piece.sum_column / piece.area_px, piece.sum_row / piece.area_px);
      if (plane.plane.inverse_depth(ray) > 1e-3) plane.centre_m = plane.plane.point(ray);
    }
    plane.piece_px += piece.area_px;
  }
  for (std::size_t p = 1; p <= plane_count_; ++p) {
    const std::int32_t least_px = on_a_step(planes_[p]) ? params_.min_surface_px : params_.min_other_px;
    planes_[p].alive = planes_[p].alive && planes_[p].piece_px >= least_px;
  }
}

// Whether the column beside a span shows the same plane.
bool SurfaceExtractor::continues(std::int32_t column, const ColumnSpan& span) const noexcept {
  if (column < 0 || column >= column_rays_.columns) return false;
  for (const ColumnSpan& other : boundaries_.columns()[static_cast<std::size_t>(column)]) {
    if (other.plane == span.plane && other.bottom >= span.top && other.top <= span.bottom) return true;
  }
  return false;
}

// Whether most measured pixels of a half-resolution column lie on the span's plane, in the span's rows.
bool SurfaceExtractor::shows(std::int32_t half_column, const ColumnSpan& span) const noexcept {
  constexpr std::int32_t kSamples = 12;
  constexpr double kFloor_m = 0.003;
  if (half_column < 0 || half_column >= rays_.width_px) return false;
  const InversePlane& plane = boundaries_.plane(span.plane).plane;
  const std::int32_t stride = std::max((span.bottom - span.top) / kSamples, 1);
  std::int32_t all = 0, on = 0;
  for (std::int32_t r = span.top; r <= span.bottom; r += stride) {
    for (const std::int32_t c : {2 * half_column, 2 * half_column + 1}) {
      const std::uint16_t raw = full_(c, r);
      if (raw < range_.min || raw > range_.max) continue;
      const double z = raw * view_.intrinsics.depth_unit_m;
      const Vec3 point = back_project(view_.intrinsics, c, r, z);
      ++all;
      on += std::abs(plane.distance_m(point)) < kFloor_m + 3.0 * noise_.sigma_m(z) ? 1 : 0;
    }
  }
  return 2 * on > all;
}

void SurfaceExtractor::begin_profile() noexcept {
  owner_.fill(0);
  for (std::size_t p = 1; p <= plane_count_; ++p) profiles_[p] = SurfaceProfile{};
}

// Whose a column's rows are, and where each surface begins and ends in it.
void SurfaceExtractor::profile(std::int32_t g) noexcept {
  for (const ColumnSpan& span : boundaries_.columns()[static_cast<std::size_t>(g)]) {
    const std::uint8_t plane = span.piece == 0 ? std::uint8_t{0} : pieces_[span.piece].plane;
    if (plane == 0 || !planes_[plane].alive) continue;
    for (std::int32_t r = span.top; r <= span.bottom; ++r) owner_(g, r) = plane;
    const bool left_end = !continues(g - 1, span), right_end = !continues(g + 1, span);
    // A column is four pixels wide: at a surface's side the pixels themselves say how far it goes.
    std::int32_t first = 2 * g, last = 2 * g + 1;
    if (left_end) {
      while (first < last && !shows(first, span)) ++first;
      while (first <= 2 * g && first > 2 * g - 2 && shows(first - 1, span)) --first;
    }
    if (right_end) {
      while (last > first && !shows(last, span)) --last;
      while (last > 2 * g && last < 2 * g + 3 && shows(last + 1, span)) ++last;
    }
    SurfaceProfile& profile = profiles_[plane];
    profile.columns[static_cast<std::size_t>(g)].add(span.top, span.bottom);
    profile.left = std::min(profile.left, first);
    profile.right = std::max(profile.right, last);
  }
}

std::uint8_t SurfaceExtractor::plane_at(std::int32_t column, std::int32_t row) const noexcept {
  return column / 2 < column_rays_.columns ? owner_(column / 2, 2 * row) : std::uint8_t{0};
}

float SurfaceExtractor::inverse_depth_at(std::int32_t column, std::int32_t row) const noexcept {
  if (column < 0 || row < 0 || column / 2 >= column_rays_.columns || row >= rays_.height_px) return 0.0F;
  const float upper = columns_.inverse_depth(column / 2, 2 * row);
  return upper > 0.0F ? upper : columns_.inverse_depth(column / 2, 2 * row + 1);
}

std::size_t SurfaceExtractor::surface_at(std::int32_t column, std::int32_t row) const noexcept {
  return column / kColumn_px < column_rays_.columns ? planes_[owner_(column / kColumn_px, row)].surface : 0U;
}

void SurfaceExtractor::outline() noexcept {
  column_outline_.build(profiles_[index_], kMaxPolygonVertices - 4, outline_);
  nosing_ = back_ = occluder_ = EdgeLine{};
  phase_ = planes_[index_].kind == SurfaceKind::kTread ? Phase::kNosing : Phase::kPolygon;
}

// Gathers where the surface ends in each column and what lies beyond; false when there is too little to look for.
bool SurfaceExtractor::begin_line(bool nosing) noexcept {
  constexpr std::int32_t kProbe_px = 8;
  // Per column: the plane beyond, 0 where there is none, or the body or the picture's end hides it.
  std::array<std::uint8_t, kColumns> beyond{};
  std::array<std::int32_t, kMaxPlanes + 1> votes{};
  const std::int32_t down = nosing ? 1 : -1;
  const auto end_of = [&](std::int32_t g) -> std::int32_t {
    const ColumnEnds& ends = profiles_[index_].columns[static_cast<std::size_t>(g)];
    return nosing ? ends.bottom : ends.top;
  };
  for (std::int32_t g = 0; g < column_rays_.columns; ++g) {
    const std::int32_t end = end_of(g), far = end + down * kProbe_px;
    if (end < 0 || far < 0 || far >= column_rays_.height_px || (flags_(2 * g, far / 2) & kPixelBody) != 0) continue;
    std::uint8_t& found = beyond[static_cast<std::size_t>(g)];
    for (std::int32_t r = end + down; found == 0 && r != far + down; r += down) found = owner_(g, r);
    ++votes[found];
  }
  // The plane beyond: most columns, and on the right side of the surface (a nosing has it below, a back line above).
  // Above, a riser is the back; without one, a higher tread whose nosing hides the rest of this surface.
  const Plane& own = planes_[index_];
  const auto most = [&](bool riser_only) {
    std::size_t other = 0;
    for (std::size_t p = 1; p <= plane_count_; ++p) {
      if (p == index_ || !planes_[p].alive || 2 * votes[p] < params_.edge_lines.min_columns) continue;
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
  for (std::int32_t g = 0; g < column_rays_.columns; ++g) {
    if (beyond[static_cast<std::size_t>(g)] == other) line_finder_.add_guess(g, end_of(g));
  }
  if (!line_finder_.try_guess(params_.edge_lines, static_cast<std::uint32_t>(index_))) {
    ++counters_.rejected_lines;
    return false;
  }
  const EdgeLineFinder::Beyond far_side{planes_[other].plane, planes_[other].covariance};
  line_finder_.begin(params_.edge_lines, noise_, view_.intrinsics, column_rays_, columns_, own.plane, &far_side,
                     nosing);
  if (!nosing && riser == 0) {
    occluder_ = line_finder_.guessed_line();
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
  (nosing ? nosing_ : back_) = line;
  leave();
  return 20;
}

// What is just outside an edge decides whether the surface ends there or only the view of it.
EdgeKind SurfaceExtractor::judge_edge(const InversePlane& plane, const Vec3& a_m, const Vec3& b_m,
                                      const Vec3& inside_m) const noexcept {
  constexpr int kProbes = 9;
  const Vec3 middle = 0.5 * (a_m + b_m);
  const auto project = [this](const Vec3& p) {
    return Vec2{p.x() / p.z() * rays_.fx_px + rays_.cx_px, p.y() / p.z() * rays_.fy_px + rays_.cy_px};
  };
  const Vec2 a = project(a_m), b = project(b_m), centre = project(inside_m);
  Vec2 outward{(b - a).y(), -(b - a).x()};
  if (outward.norm() < 1e-9) return EdgeKind::kUnknown;
  outward.normalize();
  if (outward.dot(project(middle) - centre) < 0.0) outward = -outward;
  int observed = 0;
  for (int i = 0; i < kProbes; ++i) {
    const Vec2 on = a + (b - a) * ((i + 0.5) / kProbes);
    // The first measured pixel outside, up to twice the probe's distance; the body or the picture's end before it hides
    // the end of the surface.
    const auto reach_px = static_cast<std::int32_t>(1.5 * params_.probe_px);
    for (std::int32_t k = 0; k <= reach_px; ++k) {
      const double out = 0.5 * params_.probe_px + k;
      const Vec2 p = on + out * outward;
      const auto c = static_cast<std::int32_t>(std::floor(p.x() + 0.5)),
                 r = static_cast<std::int32_t>(std::floor(p.y() + 0.5));
      if (c < 0 || c >= rays_.width_px || r < 0 || r >= rays_.height_px || (flags_(c, r) & kPixelBody) != 0) break;
      const auto w = static_cast<double>(inverse_depth_at(c, r));
      if (!(w > 0.0) || out < params_.probe_px) continue;
      const double expected = plane.inverse_depth(rays_.ray(c, r));
      // Something well in front hides it, unless it stands on the surface right here (a riser's foot).
      const bool hidden = expected > 1e-3 && 1.0 / expected - 1.0 / w > params_.apart_m;
      observed += hidden ? 0 : 1;
      break;
    }
  }
  return 2 * observed > kProbes ? EdgeKind::kObserved : EdgeKind::kUnknown;
}

// Over the polygon's rows and columns in the picture.
double SurfaceExtractor::invalid_share(const PolygonVertices& polygon) const noexcept {
  Outline2 seen;
  for (const Vec3& p : polygon) {
    static_cast<void>(
        seen.try_push_back({p.x() / p.z() * rays_.fx_px + rays_.cx_px, p.y() / p.z() * rays_.fy_px + rays_.cy_px}));
  }
  std::int32_t all = 0, invalid = 0;
  double top = 1e9, bottom = -1e9;
  for (const Vec2& p : seen) {
    top = std::min(top, p.y());
    bottom = std::max(bottom, p.y());
  }
  const auto first_row = static_cast<std::int32_t>(math::clamp(std::ceil(top), 0.0, rays_.height_px - 1.0));
  const auto last_row = static_cast<std::int32_t>(math::clamp(std::floor(bottom), 0.0, rays_.height_px - 1.0));
  for (std::int32_t r = first_row; r <= last_row; ++r) {
    double lo = 1e9, hi = -1e9;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Vec2 &a = seen[i], &b = seen[(i + 1) % seen.size()];
      if ((a.y() <= r) == (b.y() <= r)) continue;
      const double x = a.x() + (r - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      lo = std::min(lo, x);
      hi = std::max(hi, x);
    }
    if (hi < lo) continue;
    const auto left = static_cast<std::int32_t>(math::clamp(std::ceil(lo), 0.0, rays_.width_px - 1.0));
    const auto right = static_cast<std::int32_t>(math::clamp(std::floor(hi), 0.0, rays_.width_px - 1.0));
    const std::uint8_t* flags = flags_.row(r);
    const std::uint8_t* valid = columns_.valid.row(2 * r);
    for (std::int32_t c = left; c <= right && c / 2 < column_rays_.columns; c += 2) {
      if ((flags[c] & kPixelBody) != 0) continue;
      all += kColumn_px;
      invalid += kColumn_px - valid[c / 2];
    }
  }
  return all > 0 ? static_cast<double>(invalid) / all : 0.0;
}

// The tread that most columns of this surface show right below (or above) it in the picture; 0 = none.
std::size_t SurfaceExtractor::tread_beside(bool below) const noexcept {
  constexpr std::int32_t kProbe_px = 6;
  std::array<std::int32_t, kMaxPlanes + 1> votes{};
  for (std::int32_t g = 0; g < column_rays_.columns; ++g) {
    const ColumnEnds& ends = profiles_[index_].columns[static_cast<std::size_t>(g)];
    if (ends.empty()) continue;
    const std::int32_t row = below ? ends.bottom + kProbe_px : ends.top - kProbe_px;
    if (row >= 0 && row < column_rays_.height_px) ++votes[owner_(g, row)];
  }
  std::size_t best = 0;
  for (std::size_t p = 1; p <= plane_count_; ++p) {
    if (!planes_[p].alive || planes_[p].kind != SurfaceKind::kTread || votes[p] < params_.edge_lines.min_columns) {
      continue;
    }
    if (best == 0 || votes[p] > votes[best]) best = p;
  }
  return best;
}

void SurfaceExtractor::build_polygon() noexcept {
  Plane& own = planes_[index_];
  const InversePlane& plane = own.plane;
  const Vec3 n = plane.normal();
  // Plane coordinates with x along the nosing, else along the picture's rows; x cross y = n.
  Vec3 x_axis = Vec3::UnitX();
  if (nosing_.valid) {
    x_axis = nosing_.b_m - nosing_.a_m;
  } else if (back_.valid) {
    x_axis = back_.b_m - back_.a_m;
  }
  x_axis -= n * n.dot(x_axis);
  if (x_axis.norm() < 1e-6) x_axis = n.unitOrthogonal();
  x_axis.normalize();
  const Vec3 y_axis = n.cross(x_axis);
  const Vec3 origin = own.centre_m - n * plane.distance_m(own.centre_m);
  const auto to_plane = [&](const Vec3& p) { return Vec2{(p - origin).dot(x_axis), (p - origin).dot(y_axis)}; };
  const auto to_space = [&](const Vec2& p) { return Vec3{origin + p.x() * x_axis + p.y() * y_axis}; };

  // The picture's outline onto the plane: a projection keeps it convex, and turns clockwise in the picture into
  // clockwise seen from the camera, so the order is reversed.
  Outline2 flat;
  for (std::size_t i = outline_.size(); i-- > 0;) {
    const Vec3 ray = rays_.ray(outline_[i].x(), outline_[i].y());
    if (plane.inverse_depth(ray) > 0.1) static_cast<void>(flat.try_push_back(to_plane(plane.point(ray))));
  }
  const auto drop = [&] {
    own.alive = false;
    ++counters_.no_polygon;
  };
  if (flat.size() < 3 || !(twice_area(flat) > 0.0)) {
    drop();
    return;
  }
  const Vec2 middle = centroid(flat);
  const auto cut = [&](const EdgeLine& line) {
    const Vec2 a = to_plane(line.a_m), b = to_plane(line.b_m);
    Vec2 inward{-(b - a).y(), (b - a).x()};
    inward.normalize();
    if (inward.dot(middle - a) < 0.0) inward = -inward;
    // Corners just short of the line go onto it, those beyond are cut off: either way the edge is the line. Moving only
    // the two extreme ones keeps the outline convex.
    for (Vec2& p : flat) {
      const double distance = inward.dot(p - a);
      if (distance > 0.0 && distance < params_.snap_m) p -= (distance + 1e-6) * inward;
    }
    clip(flat, a, inward);
  };
  if (nosing_.valid) cut(nosing_);
  if (back_.valid) cut(back_);
  if (occluder_.valid) cut(occluder_);
  if (own.kind == SurfaceKind::kRiser) {
    // Seen nearly edge-on, half a pixel is decimetres of a riser: it ends where the treads above and below it say.
    for (const bool below : {true, false}) {
      const std::size_t tread = tread_beside(below);
      if (tread == 0) continue;
      const InversePlane& level = planes_[tread].plane;
      const double side = below ? 1.0 : -1.0;
      const Vec3 up = side * level.normal();
      const Vec2 inward{up.dot(x_axis), up.dot(y_axis)};
      if (!(inward.norm() > kLeastSlope)) continue;
      clip(flat, -side * level.distance_m(origin) * inward / inward.squaredNorm(), inward.normalized());
    }
  }
  if (flat.size() >= 3) reduce(flat, kMaxPolygonVertices, 1e-6);
  const double area_m2 = flat.size() >= 3 ? 0.5 * twice_area(flat) : 0.0;
  if (!(area_m2 > 1e-4)) {
    drop();
    return;
  }

  SurfacePatch patch;
  patch.kind = own.kind;
  patch.plane = own.source;
  patch.covariance = own.covariance;
  patch.normal = n;
  patch.d_m = plane.d_m();
  patch.area_m2 = area_m2;
  patch.centroid_m = to_space(centroid(flat));
  patch.rmse_m = math::sqrt(own.residual2 / std::max(own.moments.count, 1.0));
  patch.offset_sigma_m = plane_sigma_m(plane, own.covariance, patch.centroid_m / patch.centroid_m.z());
  const Mat3 across = Mat3::Identity() - n * n.transpose();
  patch.tilt_sigma_rad = patch.d_m * math::sqrt(std::max((across * own.covariance * across).trace(), 0.0));
  patch.nosing = nosing_;
  patch.back = back_;
  // An edge on a nosing or back line is observed if the line was seen along most of it.
  const auto seen_on = [&](const EdgeLine& line, const Vec2& a, const Vec2& b) {
    if (!line.valid) return false;
    const Vec2 p = to_plane(line.a_m), q = to_plane(line.b_m);
    const Vec2 along = (q - p).normalized(), normal{-along.y(), along.x()};
    if (std::abs(normal.dot(a - p)) > kOnLine_m || std::abs(normal.dot(b - p)) > kOnLine_m) return false;
    const double from = std::min(along.dot(a - p), along.dot(b - p)), to = std::max(along.dot(a - p), along.dot(b - p));
    return 2.0 * (std::min(to, (q - p).norm()) - std::max(from, 0.0)) > to - from;
  };
  for (std::size_t i = 0; i < flat.size(); ++i) {
    const Vec2 &a = flat[i], &b = flat[(i + 1) % flat.size()];
    static_cast<void>(patch.polygon.try_push_back(to_space(a)));
    patch.edges[i] = seen_on(nosing_, a, b) || seen_on(back_, a, b)
                         ? EdgeKind::kObserved
                         : judge_edge(plane, to_space(a), to_space(b), patch.centroid_m);
  }
  patch.invalid_fraction = invalid_share(patch.polygon);
  if (!next_.surfaces.try_push_back(patch)) {
    ++next_.dropped;
    ++counters_.plane_overflow;
    own.alive = false;
    return;
  }
  own.surface = static_cast<std::uint8_t>(next_.surfaces.size());
}

void SurfaceExtractor::finish() noexcept {
  if (const double seen = boundaries_.noise_scale(); measured_px_ > 0 && seen > 0.0) {
    noise_scale_ = math::clamp(noise_scale_ * (1.0 + params_.noise_gain * (seen - 1.0)), params_.min_noise_scale,
                               params_.max_noise_scale);
  }
  next_.invalid_fraction = outside_body_px_ > 0 ? 1.0 - static_cast<double>(measured_px_) / outside_body_px_ : 1.0;
  result_ = next_;
}

}  // namespace polygmap
