// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/connected_components.hpp"

#include <algorithm>
#include <bit>

namespace polygmap {
namespace {

// A tread that meets a riser, or a riser that meets a tread.
bool on_a_step(double min_columns, const SpanBoundaries& boundaries, const PlaneSet& planes,
               const Region& region) noexcept {
  bool found = false;
  if (region.kind == SurfaceKind::kOther) return false;
  const SurfaceKind wanted = region.kind == SurfaceKind::kTread ? SurfaceKind::kRiser : SurfaceKind::kTread;
  boundaries.for_each_meeting(region.source, [&](PlaneId other, double columns) {
    found = found || (columns >= min_columns && planes[other].kind == wanted && planes[other].alive);
  });
  return found;
}

Region region_in(const FittedPlane& fitted, PlaneId id) noexcept {
  Region region;
  region.plane = fitted.plane;
  region.kind = fitted.kind;
  region.covariance = fitted.covariance;
  region.rmse_m = math::sqrt(fitted.residual2 / std::max(fitted.moments.count, 1.0));
  region.source = id;
  region.coplanar = id;
  region.centre_m = fitted.centre_m;
  region.alive = fitted.alive;
  return region;
}

}  // namespace

void ConnectedComponents::begin_find() noexcept {
  overflow_ = 0;
  span_count_ = 0;
  component_count_ = 0;
  next_ = 0;
}

// Spans of one plane that share rows in neighbouring columns hang together.
void ConnectedComponents::link(SpanBoundaries::Columns& columns, std::int32_t column) noexcept {
  const auto root = [this](std::uint16_t i) {
    work_.add(12);
    while (parent_[i] != i) {
      work_.add(12);
      i = parent_[i] = parent_[parent_[i]];
    }
    return i;
  };
  std::size_t next = 0;  // on the left, the first span that ends no higher than this one begins
  work_.add(40);
  for (ColumnSpan& span : columns[static_cast<std::size_t>(column)]) {
    work_.add(36);
    span.component = ++span_count_;
    parent_[span_count_] = span_count_;
    if (column == 0) continue;
    const SpanBoundaries::Column& lefts = columns[static_cast<std::size_t>(column - 1)];
    while (next < lefts.size() && lefts[next].bottom < span.top) ++next;
    for (std::size_t i = next; i < lefts.size() && lefts[i].top <= span.bottom; ++i) {
      work_.add(20);
      const ColumnSpan& left = lefts[i];
      if ((static_cast<int>(left.plane == span.plane) & static_cast<int>(left.bottom >= span.top)) == 0) continue;
      const std::uint16_t a = root(left.component), b = root(span.component);
      parent_[std::max(a, b)] = std::min(a, b);
    }
  }
}

// Roots are numbered in the order of the picture; parent_ then holds the components' numbers, 0 for those without room.
bool ConnectedComponents::number_some() noexcept {
  constexpr std::size_t kAtOnce = 256;
  const std::size_t end = std::min<std::size_t>(next_ + kAtOnce, span_count_);
  work_.add(30);
  work_.add(end - next_, 10);
  while (next_ < end) {
    const std::size_t i = ++next_;
    if (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];  // a root comes before its members and has its number by now
      continue;
    }
    parent_[i] = 0;
    if (component_count_ == kMaxComponents) {
      ++overflow_;
      continue;
    }
    work_.add(20);
    components_[++component_count_] = Component{};
    parent_[i] = static_cast<std::uint16_t>(component_count_);
  }
  return next_ == span_count_;
}

void ConnectedComponents::measure(SpanBoundaries::Columns& columns, std::int32_t column) noexcept {
  work_.add(70);
  for (ColumnSpan& span : columns[static_cast<std::size_t>(column)]) {
    work_.add(50);
    span.component = parent_[span.component];
    if (span.component == 0) continue;
    Component& component = components_[span.component];
    if (component.area_px == 0.0) {
      component.left = column;
      component.top = span.top;
    }
    component.right = column;
    component.top = std::min<std::int32_t>(component.top, span.top);
    component.bottom = std::max<std::int32_t>(component.bottom, span.bottom);
    const double area_px = kColumn_px * (span.bottom - span.top + 1);
    component.plane = span.plane;
    component.area_px += area_px;
    component.sum_column += area_px * (0.5 * kColumn_px * column + 0.25 * kColumn_px - 0.5);
    component.sum_row += area_px * 0.25 * (span.top + span.bottom);
  }
}

// Two components belong together when nothing but missing data (the robot's leg, dropouts) or their own plane lies
// between. Something seen behind the plane is a hole; something in front of it hides what nobody knows.
bool ConnectedComponents::apart(const Component& a, const Component& b, const InversePlane& plane) noexcept {
  const Vec2 from = a.centre(), to = b.centre();
  std::int32_t elsewhere = 0;
  for (std::int32_t i = 0; i <= params_.apart_probes && elsewhere < params_.min_apart_probes; ++i) {
    work_.add(66);
    const Vec2 p = from + (to - from) * (static_cast<double>(i) / params_.apart_probes);
    const auto c = static_cast<std::int32_t>(p.x() + 0.5), r = static_cast<std::int32_t>(p.y() + 0.5);
    const float w = image_->inverse_depth_at(c, r);
    if (!(w > 0.0F)) continue;
    const double expected = plane.inverse_depth(image_->rays.ray(c, r));
    elsewhere += expected > 1e-3 && std::abs(1.0 / static_cast<double>(w) - 1.0 / expected) > params_.apart_m ? 1 : 0;
  }
  return elsewhere >= params_.min_apart_probes;
}

// That a component is coplanar with others of a plane says little about one farther away than it is wide: another box
// of the same height, the wall below a table. One that leaves the picture may hang together outside.
RegionId ConnectedComponents::coplanar_region(const Component& component) noexcept {
  const Regions& regions = *regions_;
  const bool leaves = component.left == 0 || component.top == 0 || component.right + 1 == image_->column_rays.columns ||
                      component.bottom + 1 == image_->column_rays.height_px;
  work_.add(20);
  if (leaves) return component.plane;
  work_.add(regions.count, 9);
  double nearest2 = component.area_px;
  RegionId coplanar = kNoRegion;
  for (RegionId id = 1; id <= regions.count; ++id) {
    const Region& region = regions[id];
    if (region.source != component.plane || region.main_component == 0) continue;
    const Component& other = components_[region.main_component];
    const double across =
        kColumn_px * std::max({0, other.left - component.right - 1, component.left - other.right - 1});
    const double down = std::max({0, other.top - component.bottom - 1, component.top - other.bottom - 1});
    const double gap2 = across * across + down * down;
    if (gap2 >= nearest2) continue;
    nearest2 = gap2;
    coplanar = region.coplanar;
  }
  return coplanar;
}

ConnectedComponents::Order ConnectedComponents::large_ones() noexcept {
  Order order;
  for (std::size_t k = 1; k <= component_count_; ++k) {
    if (components_[k].area_px < params_.min_component_px || !(*planes_)[components_[k].plane].alive) continue;
    static_cast<void>(order.try_push_back(static_cast<std::uint8_t>(k)));
  }
  std::sort(order.begin(), order.end(), [this](std::uint8_t a, std::uint8_t b) {
    const double area_a_px = components_[a].area_px, area_b_px = components_[b].area_px;
    return area_a_px != area_b_px ? area_a_px > area_b_px : a < b;
  });
  work_.add(component_count_, 19);
  work_.add(order.size() * static_cast<std::size_t>(std::bit_width(order.size())), 32);
  return order;
}

RegionId ConnectedComponents::find_region(const Component& component) noexcept {
  Regions& regions = *regions_;
  const PlaneId source = component.plane;
  const auto first_new = static_cast<RegionId>(planes_->count + 1);
  for (RegionId id = source; id <= regions.count; id = id == source ? first_new : static_cast<RegionId>(id + 1)) {
    const Region& region = regions[id];
    work_.add(12);
    if (region.source != source) continue;
    if (region.main_component == 0 || !apart(components_[region.main_component], component, region.plane)) return id;
  }
  if (component.area_px < params_.min_surface_px) return kNoRegion;
  if (regions.count == Regions::kMaxRegions) {
    ++region_overflow_;
    return kNoRegion;
  }
  const RegionId coplanar = coplanar_region(component), id = ++regions.count;
  work_.add(60);
  Region& region = regions[id] = regions[source];
  region.coplanar = coplanar != kNoRegion ? coplanar : id;
  region.main_component = 0;
  region.area_px = 0.0;
  return id;
}

void ConnectedComponents::begin_join(const Params& params, const SpanBoundaries& boundaries, const FrameImage& image,
                                     const PlaneSet& planes, Regions& regions) noexcept {
  params_ = params;
  boundaries_ = &boundaries;
  image_ = &image;
  planes_ = &planes;
  regions_ = &regions;
  region_overflow_ = 0;
  next_ = 0;
  regions.count = planes.count;
  work_.add(200);
  work_.add(planes.count, 120);
  for (PlaneId p = 1; p <= planes.count; ++p) regions[p] = region_in(planes[p], p);
  order_ = large_ones();
}

// The largest component of a plane keeps it. A component apart from that becomes a region of its own in the same plane.
void ConnectedComponents::join(std::uint8_t number) noexcept {
  Component& component = components_[number];
  work_.add(90);
  component.region = find_region(component);
  if (component.region == kNoRegion) return;
  Region& region = (*regions_)[component.region];
  if (region.main_component == 0) {
    region.main_component = number;
    const Vec2 centre = component.centre();
    const Vec3 ray = image_->rays.ray(centre.x(), centre.y());
    if (region.plane.inverse_depth(ray) > 1e-3) region.centre_m = region.plane.point(ray);
  }
  region.area_px += component.area_px;
}

void ConnectedComponents::give_up_small_ones() noexcept {
  // What is seen of one surface in several places is as sure as what is seen of it in one.
  std::array<double, Regions::kMaxRegions + 1> seen_px{};  // by the first of the regions that count as one plane
  work_.add(regions_->count, 55);
  for (RegionId id = 1; id <= regions_->count; ++id) {
    Region& region = (*regions_)[id];
    region.alive = region.alive && region.area_px >= params_.min_surface_px;
    if (region.alive) seen_px[region.coplanar] += region.area_px;
  }
  for (RegionId id = 1; id <= regions_->count; ++id) {
    Region& region = (*regions_)[id];
    if (!region.alive || seen_px[region.coplanar] >= params_.min_other_px) continue;
    work_.add(boundaries_->meetings(), 5);
    region.alive = on_a_step(params_.min_step_columns, *boundaries_, *planes_, region);
  }
  work_.add(component_count_, 8);
  for (std::size_t k = 1; k <= component_count_; ++k) {
    RegionId& region = components_[k].region;
    if (!(*regions_)[region].alive) region = kNoRegion;
  }
}

bool ConnectedComponents::join_some() noexcept {
  constexpr std::int32_t kPieceInstructions = 4000;
  const std::int32_t enough = work_.instructions() + kPieceInstructions;
  while (next_ < order_.size() && work_.instructions() < enough) join(order_[next_++]);
  if (next_ < order_.size()) return false;
  give_up_small_ones();
  return true;
}

}  // namespace polygmap
