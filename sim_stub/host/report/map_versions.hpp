// SPDX-License-Identifier: Apache-2.0
// The map over time: each polygon as the versions of it that differ.
#pragma once

#include <cstdint>
#include <map>

#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/surfaces.hpp"
#include "sim_stub/host/report/report_blocks.hpp"

namespace polygmap::sim {

class MapVersions {
 public:
  // A map from t_s on. page_T_odom: of the page's world, then.
  void add(double t_s, const MapSnapshot& map, const Transform& page_T_odom);
  // Of the newest map; null: not in it.
  [[nodiscard]] const MapPolygon* find(std::uint32_t id) const;
  // Where its polygons lie in the page's world.
  [[nodiscard]] const Transform& page_T_map() const noexcept { return page_T_map_; }
  [[nodiscard]] ReportJson json() const { return {{"polygons", polygons_}, {"occupied", occupied_}}; }

 private:
  struct Open {
    std::size_t index = 0;  // in polygons_
    MapPolygon polygon;     // as it was written
    Vec3 moved_m = Vec3::Zero();
  };
  [[nodiscard]] bool has_changed(const Open& open, const MapPolygon& polygon, const Transform& page_T_map) const;

  MapSnapshot newest_;
  Transform page_T_map_;
  std::map<std::uint32_t, Open> open_;
  ReportJson polygons_ = ReportJson::array(), occupied_ = ReportJson::array();
};

// A surface's corners, one after the other, in another frame.
[[nodiscard]] ReportJson corners_json(const PolygonVertices& corners, const Transform& to_T_from);
[[nodiscard]] const char* kind_text(SurfaceKind kind) noexcept;

}  // namespace polygmap::sim
