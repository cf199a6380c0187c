// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/regions/connected_components.hpp"

#include <algorithm>

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

void ConnectedComponents::find(SpanBoundaries::Columns& columns, std::int32_t column_count) noexcept {
  overflow_ = 0;
  number(link(columns, column_count));
  measure(columns, column_count);
}

// Spans of one plane that share rows in neighbouring columns hang together. Returns how many spans there are.
std::uint16_t ConnectedComponents::link(SpanBoundaries::Columns& columns, std::int32_t column_count) noexcept {
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
  return count;
}

// Roots are numbered in the order of the picture; parent_ then holds the components' numbers, 0 for those without room.
void ConnectedComponents::number(std::uint16_t span_count) noexcept {
  component_count_ = 0;
  for (std::uint16_t i = 1; i <= span_count; ++i) {
    if (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];  // a root comes before its members and has its number by now
      continue;
    }
    parent_[i] = 0;
    if (component_count_ == kMaxComponents) {
      ++overflow_;
      continue;
    }
    components_[++component_count_] = Component{};
    parent_[i] = static_cast<std::uint16_t>(component_count_);
  }
}

void ConnectedComponents::measure(SpanBoundaries::Columns& columns, std::int32_t column_count) noexcept {
  for (std::int32_t g = 0; g < column_count; ++g) {
    for (ColumnSpan& span : columns[static_cast<std::size_t>(g)]) {
      span.component = parent_[span.component];
      if (span.component == 0) continue;
      Component& component = components_[span.component];
      if (component.area_px == 0.0) {
        component.left = g;
        component.top = span.top;
      }
      component.right = g;
      component.top = std::min<std::int32_t>(component.top, span.top);
      component.bottom = std::max<std::int32_t>(component.bottom, span.bottom);
      const double area_px = kColumn_px * (span.bottom - span.top + 1);
      component.plane = span.plane;
      component.area_px += area_px;
      component.sum_column += area_px * (0.5 * kColumn_px * g + 0.25 * kColumn_px - 0.5);
      component.sum_row += area_px * 0.25 * (span.top + span.bottom);
    }
  }
}

// Two components belong together when nothing but missing data (the robot's leg, dropouts) or their own plane lies
// between. Something seen behind the plane is a hole; something in front of it hides what nobody knows.
bool ConnectedComponents::apart(const Params& params, const FrameImage& image, const Component& a, const Component& b,
                                const InversePlane& plane) noexcept {
  const Vec2 from = a.centre(), to = b.centre();
  std::int32_t elsewhere = 0;
  for (std::int32_t i = 0; i <= params.apart_probes && elsewhere < params.min_apart_probes; ++i) {
    const Vec2 p = from + (to - from) * (static_cast<double>(i) / params.apart_probes);
    const auto c = static_cast<std::int32_t>(p.x() + 0.5), r = static_cast<std::int32_t>(p.y() + 0.5);
    const float w = image.inverse_depth_at(c, r);
    if (!(w > 0.0F)) continue;
    const double expected = plane.inverse_depth(image.rays.ray(c, r));
    elsewhere += expected > 1e-3 && std::abs(1.0 / static_cast<double>(w) - 1.0 / expected) > params.apart_m ? 1 : 0;
  }
  return elsewhere >= params.min_apart_probes;
}

// That a component is coplanar with others of a plane says little about one farther away than it is wide: another box
// of the same height, the wall below a table. One that leaves the picture may hang together outside.
RegionId ConnectedComponents::coplanar_region(const FrameImage& image, const Regions& regions,
                                              const Component& component) const noexcept {
  const bool leaves = component.left == 0 || component.top == 0 || component.right + 1 == image.column_rays.columns ||
                      component.bottom + 1 == image.column_rays.height_px;
  if (leaves) return component.plane;
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

ConnectedComponents::Order ConnectedComponents::large_ones(const Params& params,
                                                           const PlaneSet& planes) const noexcept {
  Order order;
  for (std::size_t k = 1; k <= component_count_; ++k) {
    if (components_[k].area_px < params.min_component_px || !planes[components_[k].plane].alive) continue;
    static_cast<void>(order.try_push_back(static_cast<std::uint8_t>(k)));
  }
  std::sort(order.begin(), order.end(), [this](std::uint8_t a, std::uint8_t b) {
    const double area_a_px = components_[a].area_px, area_b_px = components_[b].area_px;
    return area_a_px != area_b_px ? area_a_px > area_b_px : a < b;
  });
  return order;
}

RegionId ConnectedComponents::find_region(const Params& params, const FrameImage& image, RegionId first_new,
                                          const Component& component, Regions& regions) noexcept {
  const PlaneId source = component.plane;
  for (RegionId id = source; id <= regions.count; id = id == source ? first_new : static_cast<RegionId>(id + 1)) {
    const Region& region = regions[id];
    if (region.source != source) continue;
    if (region.main_component == 0 ||
        !apart(params, image, components_[region.main_component], component, region.plane))
      return id;
  }
  if (component.area_px < params.min_surface_px) return kNoRegion;
  if (regions.count == Regions::kMaxRegions) {
    ++region_overflow_;
    return kNoRegion;
  }
  const RegionId coplanar = coplanar_region(image, regions, component), id = ++regions.count;
  Region& region = regions[id] = regions[source];
  region.coplanar = coplanar != kNoRegion ? coplanar : id;
  region.main_component = 0;
  region.area_px = 0.0;
  return id;
}

// The largest component of a plane keeps it. A component apart from that becomes a region of its own in the same plane.
std::uint32_t ConnectedComponents::join(const Params& params, const SpanBoundaries& boundaries, const FrameImage& image,
                                        const PlaneSet& planes, Regions& regions) noexcept {
  region_overflow_ = 0;
  regions.count = planes.count;
  for (PlaneId p = 1; p <= planes.count; ++p) regions[p] = region_in(planes[p], p);
  const auto first_new = static_cast<RegionId>(planes.count + 1);
  for (const std::uint8_t number : large_ones(params, planes)) {
    Component& component = components_[number];
    component.region = find_region(params, image, first_new, component, regions);
    if (component.region == kNoRegion) continue;
    Region& region = regions[component.region];
    if (region.main_component == 0) {
      region.main_component = number;
      const Vec2 centre = component.centre();
      const Vec3 ray = image.rays.ray(centre.x(), centre.y());
      if (region.plane.inverse_depth(ray) > 1e-3) region.centre_m = region.plane.point(ray);
    }
    region.area_px += component.area_px;
  }
  for (RegionId id = 1; id <= regions.count; ++id) {
    Region& region = regions[id];
    region.alive =
        region.alive && region.area_px >= params.min_surface_px &&
        (region.area_px >= params.min_other_px || on_a_step(params.min_step_columns, boundaries, planes, region));
  }
  for (std::size_t k = 1; k <= component_count_; ++k) {
    RegionId& region = components_[k].region;
    if (!regions[region].alive) region = kNoRegion;
  }
  return region_overflow_;
}

}  // namespace polygmap
