// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/polygons/polygon_builder.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
namespace {

using SeenPolygon = StaticVector<Vec2, kMaxPolygonVertices>;  // its corners in the picture, half-resolution pixels

// Adds a row's columns first .. last that are not the robot's own, and the valid pixels in them. flags: null where
// nothing is the robot's own.
void count_pixels(const std::uint8_t* flags, const std::uint8_t* valid, std::int32_t first, std::int32_t last,
                  std::int32_t& free_columns, std::int32_t& valid_px) noexcept {
  using Bytes = cv::v_uint8x16;
  static_assert(kColumns % Bytes::nlanes == 0 && kColumns <= 256, "columns are counted in whole registers of bytes");
  static constexpr std::array<std::uint8_t, kColumns> kIndices = [] {
    std::array<std::uint8_t, kColumns> indices{};
    for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<std::uint8_t>(i);
    return indices;
  }();
  const Bytes from = cv::v_setall_u8(static_cast<std::uint8_t>(first)),
              to = cv::v_setall_u8(static_cast<std::uint8_t>(last)), is_body = cv::v_setall_u8(kPixelBody),
              none = cv::v_setzero_u8();
  // No lane gets more than 8 * kColumns / nlanes.
  Bytes free_sum = none, valid_sum = none;
  if (flags == nullptr) {
    for (std::int32_t g = first / Bytes::nlanes * Bytes::nlanes; g <= last; g += Bytes::nlanes) {
      const Bytes index = cv::v_load(kIndices.data() + g);
      const Bytes wanted = (cv::v_max(index, from) == index) & (cv::v_min(index, to) == index);
      valid_sum = cv::v_add_wrap(valid_sum, cv::v_load(valid + g) & wanted);
    }
    free_columns += last - first + 1;
    valid_px += static_cast<std::int32_t>(cv::v_reduce_sum(valid_sum));
    return;
  }
  for (std::int32_t g = first / Bytes::nlanes * Bytes::nlanes; g <= last; g += Bytes::nlanes) {
    const Bytes index = cv::v_load(kIndices.data() + g);
    const Bytes wanted = (cv::v_max(index, from) == index) & (cv::v_min(index, to) == index);
    Bytes a, b, c, d;
    cv::v_load_deinterleave(flags + 4 * static_cast<std::ptrdiff_t>(g), a, b, c, d);
    const Bytes seen = ((((a | b) | (c | d)) & is_body) == none) & wanted;
    free_sum = cv::v_sub_wrap(free_sum, seen);
    valid_sum = cv::v_add_wrap(valid_sum, cv::v_load(valid + g) & seen);
  }
  free_columns += static_cast<std::int32_t>(cv::v_reduce_sum(free_sum));
  valid_px += static_cast<std::int32_t>(cv::v_reduce_sum(valid_sum));
}

// Of a point, in half-resolution pixels.
Vec2 project(const HalfRays& rays, const Vec3& p_m) noexcept {
  const double w = 1.0 / p_m.z();
  return {p_m.x() * w * rays.fx_px + rays.cx_px, p_m.y() * w * rays.fy_px + rays.cy_px};
}

// Share of a polygon's pixels without data, over its columns in the picture in some of its rows.
double invalid_share(const FrameImage& picture, const SeenPolygon& polygon) noexcept {
  constexpr std::int32_t kRows = 32;  // more say the same
  const HalfRays& rays = picture.rays;
  const auto first_from = [&](double y) {
    return static_cast<std::int32_t>(std::ceil(math::clamp(y, 0.0, rays.height_px)));
  };
  const auto last_until = [&](double y) {
    return static_cast<std::int32_t>(std::floor(math::clamp(y, -1.0, rays.height_px - 1.0)));
  };
  double highest = 1e9, lowest = -1e9;
  for (const Vec2& p : polygon) highest = std::min(highest, p.y()), lowest = std::max(lowest, p.y());
  const std::int32_t first_row = first_from(highest), last_row = last_until(lowest);
  const std::int32_t stride = 1 + std::max(last_row - first_row, 0) / kRows;
  // From which column to which the convex polygon reaches in each of these rows: two of its edges cross it.
  struct Reach {
    double left = 1e9, right = -1e9;
  };
  std::array<Reach, kRows + 1> reach;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 *upper = &polygon[i], *lower = &polygon[i + 1 < polygon.size() ? i + 1 : 0];
    if (lower->y() < upper->y()) std::swap(upper, lower);
    const std::int32_t first = (first_from(upper->y()) - first_row + stride - 1) / stride;
    const std::int32_t last = last_until(lower->y()) - first_row;
    const double step = (lower->x() - upper->x()) / std::max(lower->y() - upper->y(), 1e-9);
    double x = upper->x() + (first_row + first * stride - upper->y()) * step;
    for (std::int32_t k = first; k * stride <= last; ++k) {
      Reach& row = reach[static_cast<std::size_t>(k)];
      row.left = std::min(row.left, x);
      row.right = std::max(row.right, x);
      x += step * stride;
    }
  }
  std::int32_t free = 0, valid = 0;
  for (std::int32_t r = first_row; r <= last_row; r += stride) {
    const Reach& row = reach[static_cast<std::size_t>((r - first_row) / stride)];
    // Columns whose middles, at 4 g + 1.5 in steps of two pixels, lie within.
    const auto left =
        static_cast<std::int32_t>(std::ceil(math::clamp((row.left + 0.5) / (0.5 * kColumn_px) - 0.5, 0.0, kColumns)));
    const auto right = static_cast<std::int32_t>(
        std::floor(math::clamp((row.right + 0.5) / (0.5 * kColumn_px) - 0.5, -1.0, picture.column_rays.columns - 1.0)));
    const std::uint8_t* flags = picture.body_rows[static_cast<std::size_t>(r)] ? picture.flags.row(r) : nullptr;
    if (left <= right) count_pixels(flags, picture.columns.valid.row(2 * r), left, right, free, valid);
  }
  return free > 0 ? 1.0 - static_cast<double>(valid) / (kColumn_px * free) : 0.0;
}

}  // namespace

Outline2 PolygonBuilder::seen_of(const Outline2& flat) noexcept {
  Outline2 seen;
  work_.add(40);
  work_.add(flat.size(), 40);
  for (const Vec2& p : flat) static_cast<void>(seen.try_push_back(project(picture_->rays, axes_.to_space(p))));
  return seen;
}

bool PolygonBuilder::is_own(std::int32_t column, std::int32_t row) const noexcept {
  const RegionId label = regions_->labels.at(column, row);
  return label != kNoRegion && (*regions_)[label].coplanar == own().coplanar;
}

// What is just outside an edge decides whether the surface ends there or only the view of it.
EdgeKind PolygonBuilder::judge_edge(const Vec2& a, const Vec2& b, const Vec2& inside) noexcept {
  const FrameImage& picture = *picture_;
  const InversePlane& plane = own().plane;
  work_.add(110);
  const std::int32_t probes = params_.probes;
  Vec2 outward{(b - a).y(), -(b - a).x()};
  if (outward.norm() < 1e-9) return EdgeKind::kUnknown;
  outward.normalize();
  if (outward.dot(a - inside) < 0.0) outward = -outward;
  // From half the probe's distance to twice as far, both of which go with that parameter.
  const auto reach_px = static_cast<std::int32_t>(1.5 * params_.probe_px);
  // Nearer than the probe only the body is asked for.
  const auto nearest_px = picture.any_body ? 0 : static_cast<std::int32_t>(std::ceil(0.5 * params_.probe_px));
  std::int32_t observed = 0;
  // Until enough of them say so, or too few are left that could.
  for (std::int32_t i = 0; i < probes && 2 * observed <= probes && 2 * (observed + probes - i) > probes; ++i) {
    const Vec2 on = a + (b - a) * ((i + 0.5) / probes);
    // The first measured pixel outside, up to twice the probe's distance; the body or the picture's end before it hides
    // the end of the surface.
    for (std::int32_t k = nearest_px; k <= reach_px; ++k) {
      work_.add(58);
      const double out = 0.5 * params_.probe_px + k;
      const Vec2 p = on + out * outward;
      const auto c = static_cast<std::int32_t>(std::floor(p.x() + 0.5)),
                 r = static_cast<std::int32_t>(std::floor(p.y() + 0.5));
      if (c < 0 || c >= picture.rays.width_px || r < 0 || r >= picture.rays.height_px || picture.body(c, r)) break;
      if (out < params_.probe_px) continue;
      const auto w = static_cast<double>(picture.inverse_depth_at(c, r));
      if (!(w > 0.0)) continue;
      const double expected = plane.inverse_depth(picture.rays.ray(c, r));
      const double apart_m = (w - expected) / std::max(expected * w, 1e-6);
      // Something well in front hides it, unless it stands on the surface right here (a riser's foot).
      const bool hidden = expected > 1e-3 && apart_m > params_.apart_m;
      // The polygon ends where a leg splits the surface, and the surface goes on.
      const bool goes_on = std::abs(apart_m) < params_.goes_on_m && is_own(c / (kColumn_px / 2), 2 * r);
      observed += hidden || goes_on ? 0 : 1;
      break;
    }
  }
  return 2 * observed > probes ? EdgeKind::kObserved : EdgeKind::kUnknown;
}

// The tread that most columns of this surface show right below (or above) it in the picture.
RegionId PolygonBuilder::tread_beside(bool below) noexcept {
  const FrameImage& picture = *picture_;
  const Regions& regions = *regions_;
  const std::int32_t probe_px = params_.tread_probe_px;
  const ColumnExtents& profile = regions.extents[id_];
  work_.add(140 + 15 * std::max(profile.last_column - profile.first_column, 0) + 9 * regions.count);
  std::array<std::int32_t, Regions::kMaxRegions + 1> votes{};
  for (std::int32_t g = profile.first_column; g <= profile.last_column; ++g) {
    const ColumnExtent& ends = profile.columns[static_cast<std::size_t>(g)];
    if (ends.empty()) continue;
    const std::int32_t row = below ? ends.bottom + probe_px : ends.top - probe_px;
    if (row >= 0 && row < picture.column_rays.height_px) ++votes[regions.labels.at(g, row)];
  }
  RegionId best = kNoRegion;
  for (RegionId p = 1; p <= regions.count; ++p) {
    if (votes[p] < params_.min_tread_columns || !regions[p].alive || regions[p].kind != SurfaceKind::kTread) continue;
    if (best == kNoRegion || votes[p] > votes[best]) best = p;
  }
  return best;
}

// Plane coordinates with x along the nosing, else along the picture's rows; x cross y = normal.
PlaneAxes PolygonBuilder::axes_of(const Region& own, const SurfaceLines& lines) noexcept {
  PlaneAxes axes;
  axes.normal = own.plane.normal();
  const Vec3& n = axes.normal;
  axes.x = Vec3::UnitX();
  if (lines.nosing.valid) {
    axes.x = lines.nosing.b_m - lines.nosing.a_m;
  } else if (lines.back.valid) {
    axes.x = lines.back.b_m - lines.back.a_m;
  }
  axes.x -= n * n.dot(axes.x);
  if (axes.x.norm() < 1e-6) axes.x = n.unitOrthogonal();
  axes.x.normalize();
  axes.y = n.cross(axes.x);
  axes.origin_m = own.centre_m - n * own.plane.distance_m(own.centre_m);
  return axes;
}

PlaneSide PlaneAxes::side_of(const Vec3& line) const noexcept {
  const Vec2 inward{line.dot(x), line.dot(y)};
  return {-line.dot(origin_m) * inward / std::max(inward.squaredNorm(), 1e-12), inward.normalized()};
}

// The surface ends at the line, where most of its pixels lie. What goes on beyond the line's end, as a floor does
// beside the stairs, is a piece by itself.
bool PolygonBuilder::try_cut_at_line(const EdgeLine& edge) noexcept {
  if (!edge.valid) return true;
  work_.add(250 + 90 * static_cast<std::int32_t>(pieces_.front().flat.size()));
  const Vec2 a = axes_.to_plane(edge.a_m), b = axes_.to_plane(edge.b_m);
  Vec2 inward{-(b - a).y(), (b - a).x()};
  inward.normalize();
  const Vec3 line = edge.a_m.cross(edge.b_m);
  const PixelCover::Sides own = cover().own_by_side(*outline_, line);
  const bool positive = own.positive > own.negative;
  if ((inward.dot(axes_.side_of(line).inward) > 0.0) != positive) inward = -inward;
  Piece& piece = pieces_.front();
  const bool goes_on = std::min(own.positive, own.negative) >= params_.min_own;
  const bool has_room = !goes_on || try_split_off(piece, {a, -inward});
  // Corners just short of the line go onto it, those beyond are cut off: either way the edge is the line. Moving only
  // the two extreme ones keeps the outline convex.
  for (Vec2& p : piece.flat) {
    const double distance = inward.dot(p - a);
    if (distance > 0.0 && distance < params_.snap_m) p -= (distance + 1e-6) * inward;
  }
  clip(piece.flat, a, inward);
  return has_room;
}

// Seen nearly edge-on, half a pixel is decimetres of a riser: it ends where the treads above and below it say.
void PolygonBuilder::cut_at_treads(Outline2& flat) noexcept {
  for (const bool below : {true, false}) {
    const RegionId tread = tread_beside(below);
    if (tread == kNoRegion) continue;
    work_.add(120);
    work_.add(flat.size(), 60);
    const InversePlane& level = (*regions_)[tread].plane;
    const double side = below ? 1.0 : -1.0;
    const Vec3 up = side * level.normal();
    const Vec2 inward{up.dot(axes_.x), up.dot(axes_.y)};
    if (!(inward.norm() > params_.min_tread_sin)) continue;
    clip(flat, -side * level.distance_m(axes_.origin_m) * inward / inward.squaredNorm(), inward.normalized());
  }
}

// The side of a cut that is not kept becomes a piece. False where there is no room for one that has enough of the
// surface.
bool PolygonBuilder::try_split_off(const Piece& from, const PlaneSide& side) noexcept {
  Piece piece = from;
  work_.add(600);
  work_.add(piece.flat.size(), 60);
  clip(piece.flat, side.point, side.inward);
  static_cast<void>(piece.cuts.try_push_back(side));
  if (piece.flat.size() < 3) return true;
  piece.pixels = cover().count(seen_of(piece.flat));
  if (piece.pixels->own < params_.min_own) return true;
  return pieces_.try_push_back(piece);
}

// No line says so, but a hull around a corner covers what is not its own: the best cut parts it. A piece that was split
// off and keeps too little of the surface, or stays over what others own, is no piece.
void PolygonBuilder::count_piece() noexcept {
  if (next_ == pieces_.size()) {
    next_ = 0;
    part_ = Part::kPatches;
    return;
  }
  Piece& piece = pieces_[next_];
  if (piece.flat.size() < 3) return leave_piece(true);
  seen_ = seen_of(piece.flat);
  const PixelCover::Count pixels = piece.pixels ? *piece.pixels : cover().count(seen_);
  piece.pixels.reset();
  if (next_ > 0 && pixels.own < params_.min_own) return leave_piece(false);
  if (pixels.foreign < params_.min_foreign || pixels.foreign < params_.most_foreign * (pixels.own + pixels.foreign)) {
    return leave_piece(true);
  }
  if (piece.cuts.size() == kMaxCuts) return leave_piece(next_ == 0);
  part_ = Part::kBeginCut;
}

void PolygonBuilder::leave_piece(bool keep) noexcept {
  if (!keep) pieces_[next_].flat.clear();
  ++next_;
  part_ = Part::kPieces;
}

void PolygonBuilder::cut_piece() noexcept {
  if (!cut_.worth_it()) return leave_piece(next_ == 0);
  Piece& piece = pieces_[next_];
  const PlaneSide kept = axes_.side_of(cut_.line);
  if (!try_split_off(piece, {kept.point, -kept.inward})) ++built_.without_room;
  work_.add(100);
  work_.add(piece.flat.size(), 60);
  clip(piece.flat, kept.point, kept.inward);
  static_cast<void>(piece.cuts.try_push_back(kept));
  part_ = Part::kPieces;
}

std::optional<SurfacePatch> PolygonBuilder::patch_of(Piece& piece) noexcept {
  Outline2& flat = piece.flat;
  const Region& own = this->own();
  const PlaneAxes& axes = axes_;
  const auto corners = static_cast<std::int32_t>(flat.size());
  work_.add(700);
  if (flat.size() >= 3) reduce(flat, kMaxPolygonVertices, 1e-6);
  work_.add((corners - static_cast<std::int32_t>(flat.size()) + 1) * corners * 20 + corners * 60);
  const double area_m2 = flat.size() >= 3 ? 0.5 * twice_area(flat) : 0.0;
  if (!(area_m2 > 1e-4)) return std::nullopt;
  SurfacePatch patch;
  patch.kind = own.kind;
  patch.plane = own.coplanar;
  patch.covariance = own.covariance;
  patch.normal = axes.normal;
  patch.d_m = own.plane.d_m();
  patch.area_m2 = area_m2;
  patch.centroid_m = axes.to_space(centroid(flat));
  patch.rmse_m = own.rmse_m;
  patch.offset_sigma_m = plane_sigma_m(own.plane, own.covariance, patch.centroid_m / patch.centroid_m.z());
  const Mat3 across = Mat3::Identity() - axes.normal * axes.normal.transpose();
  patch.tilt_sigma_rad = patch.d_m * math::sqrt(std::max((across * own.covariance * across).trace(), 0.0));
  for (const Vec2& p : flat) static_cast<void>(patch.polygon.try_push_back(axes.to_space(p)));
  judge_edges(piece, patch);
  return patch;
}

void PolygonBuilder::judge_edges(const Piece& piece, SurfacePatch& patch) noexcept {
  const FrameImage& picture = *picture_;
  const SurfaceLines& lines = *lines_;
  const PlaneAxes& axes = axes_;
  work_.add(piece.flat.size(), 160);
  // An edge on a nosing or back line is observed if the line was seen along most of it.
  const auto seen_on = [&](const EdgeLine& line, const Vec2& a, const Vec2& b) {
    if (!line.valid) return false;
    const Vec2 p = axes.to_plane(line.a_m), q = axes.to_plane(line.b_m);
    const Vec2 along = (q - p) / std::max((q - p).norm(), 1e-9), normal{-along.y(), along.x()};
    if (std::abs(normal.dot(a - p)) > params_.on_line_m || std::abs(normal.dot(b - p)) > params_.on_line_m)
      return false;
    const double from = std::min(along.dot(a - p), along.dot(b - p)), to = std::max(along.dot(a - p), along.dot(b - p));
    return 2.0 * (std::min(to, (q - p).norm()) - std::max(from, 0.0)) > to - from;
  };
  // Where it was cut back, the surface goes on.
  const auto cut_back = [&](const Vec2& a, const Vec2& b) {
    return std::any_of(piece.cuts.begin(), piece.cuts.end(), [&](const PlaneSide& side) {
      return std::abs(side.inward.dot(a - side.point)) < params_.on_line_m &&
             std::abs(side.inward.dot(b - side.point)) < params_.on_line_m;
    });
  };
  SeenPolygon seen;
  for (const Vec3& p_m : patch.polygon) static_cast<void>(seen.try_push_back(project(picture.rays, p_m)));
  const Vec2 inside = project(picture.rays, patch.centroid_m);
  for (std::size_t i = 0; i < piece.flat.size(); ++i) {
    const std::size_t next = i + 1 < piece.flat.size() ? i + 1 : 0;
    const Vec2 &a = piece.flat[i], &b = piece.flat[next];
    const bool on_nosing = seen_on(lines.nosing, a, b), on_back = seen_on(lines.back, a, b);
    patch.edges[i] = EdgeKind::kUnknown;
    if (cut_back(a, b)) continue;
    const bool on_line = on_nosing || on_back;
    patch.edges[i] = on_line ? EdgeKind::kObserved : judge_edge(seen[i], seen[next], inside);
    if (on_nosing) patch.nosing = lines.nosing;
    if (on_back) patch.back = lines.back, patch.back_drops = lines.back_drops;
  }
  work_.add(picture.any_body ? 6000 : 4000);
  patch.invalid_fraction = invalid_share(picture, seen);
}

void PolygonBuilder::begin(const FrameImage& picture, const Regions& regions, RegionId id, const Outline2& outline,
                           const SurfaceLines& lines, SurfacePatches& patches) noexcept {
  picture_ = &picture;
  regions_ = &regions;
  id_ = id;
  outline_ = &outline;
  lines_ = &lines;
  patches_ = &patches;
  axes_ = axes_of(own(), lines);
  built_ = {};
  pieces_.clear();
  next_ = 0;
  part_ = Part::kDone;
  work_.add(500);
  work_.add(outline.size(), 60);
  // The picture's outline onto the plane: a projection keeps it convex, and turns clockwise in the picture into
  // clockwise seen from the camera, so the order is reversed.
  static_cast<void>(pieces_.try_push_back({}));
  Outline2& flat = pieces_.front().flat;
  const InversePlane& plane = own().plane;
  for (std::size_t i = outline.size(); i-- > 0;) {
    const Vec3 ray = picture.rays.ray(outline[i].x(), outline[i].y());
    if (plane.inverse_depth(ray) > 0.1) static_cast<void>(flat.try_push_back(axes_.to_plane(plane.point(ray))));
  }
  if (flat.size() < 3 || !(twice_area(flat) > 0.0)) return;
  if (own().kind == SurfaceKind::kRiser) cut_at_treads(flat);
  part_ = Part::kLines;
}

bool PolygonBuilder::step() noexcept {
  const std::array<const EdgeLine*, 3> edges{&lines_->nosing, &lines_->back, &lines_->occluder};
  switch (part_) {
    case Part::kLines:
      if (!try_cut_at_line(*edges[next_])) ++built_.without_room;
      if (++next_ < edges.size()) return false;
      next_ = 0;
      part_ = Part::kPieces;
      return false;
    case Part::kPieces:
      count_piece();
      return false;
    case Part::kBeginCut:
      cover().begin_cut(seen_, cut_);
      part_ = Part::kTryCut;
      return false;
    case Part::kTryCut:
      if (!cover().try_neighbour(seen_, cut_)) part_ = Part::kCut;
      return false;
    case Part::kCut:
      cut_piece();
      return false;
    case Part::kPatches:
      add_patch();
      return part_ == Part::kDone;
    case Part::kDone:
      break;
  }
  return true;
}

void PolygonBuilder::add_patch() noexcept {
  Piece& piece = pieces_[next_];
  std::optional<SurfacePatch> patch = patch_of(piece);
  if (patch) {
    if (next_ == 0) patch->nosing = lines_->nosing, patch->back = lines_->back, patch->back_drops = lines_->back_drops;
    ++(patches_->try_push_back(*patch) ? built_.pieces : built_.without_room);
  }
  if (++next_ == pieces_.size()) part_ = Part::kDone;
}

}  // namespace polygmap
