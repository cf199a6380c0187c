// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/report/map_versions.hpp"

#include <algorithm>
#include <array>

namespace polygmap::sim {
namespace {

constexpr double kSame_m = 0.004;  // no corner has moved farther: nobody could see it

ReportJson line_json(const EdgeLine& line, const Transform& to_T_from) {
  const Vec3 a = to_T_from * line.a_m, b = to_T_from * line.b_m;
  return rounded(std::array{a.x(), a.y(), a.z(), b.x(), b.y(), b.z()});
}

}  // namespace

const char* kind_text(SurfaceKind kind) noexcept {
  return kind == SurfaceKind::kTread ? "tread" : kind == SurfaceKind::kRiser ? "riser" : "other";
}

ReportJson corners_json(const PolygonVertices& corners, const Transform& to_T_from) {
  ReportJson list = ReportJson::array();
  for (const Vec3& corner : corners) {
    const Vec3 there = to_T_from * corner;
    for (int i = 0; i < 3; ++i) list.push_back(rounded(there[i]));
  }
  return list;
}

const MapPolygon* MapVersions::find(std::uint32_t id) const {
  const auto found = std::ranges::find(newest_.polygons, id, &MapPolygon::id);
  return found == newest_.polygons.end() ? nullptr : found;
}

bool MapVersions::has_changed(const Open& open, const MapPolygon& polygon, const Transform& page_T_map) const {
  const PolygonVertices &before = open.polygon.surface.polygon, &after = polygon.surface.polygon;
  if (before.size() != after.size() || open.polygon.surface.kind != polygon.surface.kind) return true;
  if ((page_T_map.p_m - open.moved_m).norm() > kSame_m) return true;
  for (std::size_t i = 0; i < after.size(); ++i) {
    if ((before[i] - after[i]).norm() > kSame_m) return true;
  }
  return open.polygon.surface.nosing.valid != polygon.surface.nosing.valid;
}

void MapVersions::add(double t_s, const MapSnapshot& map, const Transform& page_T_odom) {
  newest_ = map;
  page_T_map_ = page_T_odom;
  page_T_map_.p_m += page_T_odom.R * map.drift_m;
  const ReportJson at = rounded(t_s, 3);
  for (auto it = open_.begin(); it != open_.end();) {
    const bool is_gone = find(it->first) == nullptr;
    if (is_gone) polygons_[it->second.index]["to_s"] = at;
    it = is_gone ? open_.erase(it) : std::next(it);
  }
  for (const MapPolygon& polygon : map.polygons) {
    const auto before = open_.find(polygon.id);
    if (before != open_.end() && !has_changed(before->second, polygon, page_T_map_)) continue;
    if (before != open_.end()) polygons_[before->second.index]["to_s"] = at;
    const SurfacePatch& surface = polygon.surface;
    ReportJson observed = ReportJson::array();
    for (std::size_t i = 0; i < surface.polygon.size(); ++i) {
      observed.push_back(surface.edges[i] == EdgeKind::kObserved ? 1 : 0);
    }
    ReportJson version{{"id", polygon.id},     {"kind", kind_text(surface.kind)},
                       {"from_s", at},         {"sigma_m", rounded(surface.offset_sigma_m, 5)},
                       {"observed", observed}, {"vertices", corners_json(surface.polygon, page_T_map_)}};
    if (surface.nosing.valid) version["nosing"] = line_json(surface.nosing, page_T_map_);
    open_[polygon.id] = {polygons_.size(), polygon, page_T_map_.p_m};
    polygons_.push_back(std::move(version));
  }
  ReportJson cells = ReportJson::array();
  for (const OccupiedCell& cell : map.occupied) {
    const Vec3 middle = page_T_map_ * Vec3(cell.x_m, cell.y_m, cell.ground_m);
    cells.push_back(rounded(std::array{middle.x(), middle.y(), middle.z(), cell.height_m}));
  }
  const bool is_same = occupied_.empty() ? cells.empty() : occupied_.back()["cells"] == cells;
  if (is_same) return;
  if (!occupied_.empty()) occupied_.back()["to_s"] = at;
  occupied_.push_back({{"from_s", at}, {"cells", std::move(cells)}});
}

}  // namespace polygmap::sim
