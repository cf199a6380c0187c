// SPDX-License-Identifier: Apache-2.0
// What a row of the schedule left behind, as values again: of each kind the newest.
#pragma once

#include "firmware/recording/stream/record.hpp"

namespace polygmap::recording {

struct RowOutputs {
  enum class Left : std::uint8_t { kNothing, kState, kGait, kHealth, kSurfaces, kMap, kFootholds };

  StateEstimate state;
  EstimateQuality quality;  // of the state
  GaitStatus gait;
  ModuleState module_state{};
  HealthCounts health{};  // of control's row: all lanes'
  SurfaceFrame surfaces;
  MapSnapshot map;
  FootholdSet footholds;

  // Takes the row's; which of them changed. Kinds that nobody asks for are kNothing.
  Left read(const RowCall& row) noexcept {
    ByteReader in = row.outputs;
    FieldReader reader(in);
    const bool is_done = row.progress == static_cast<std::uint8_t>(Progress::kDone);
    switch (row.row) {
      case kEstimateRow:
        walk(reader, "state", state);
        walk(reader, "quality", quality);
        return Left::kState;
      case kGaitRow:
        walk(reader, "status", gait);
        walk(reader, "module_state", module_state);
        return Left::kGait;
      case kHealthRow:
        if (!in.get<bool>()) return Left::kNothing;
        for (EventCount& count : health) walk(reader, "", count);
        return Left::kHealth;
      case kSurfacesRow:
        if (is_done) walk(reader, "frame", surfaces);
        return is_done ? Left::kSurfaces : Left::kNothing;
      case kMapRow:
        if (is_done) walk(reader, "map", map);
        return is_done ? Left::kMap : Left::kNothing;
      case kFootholdsRow:
        if (is_done) walk(reader, "footholds", footholds);
        return is_done ? Left::kFootholds : Left::kNothing;
      default:
        return Left::kNothing;
    }
  }
};

}  // namespace polygmap::recording
