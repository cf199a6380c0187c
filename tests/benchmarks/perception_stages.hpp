// SPDX-License-Identifier: Apache-2.0
// Perception cut into stages, each a function of its own: a clock can be read around it, and callgrind counts what is
// spent inside it.
#pragma once

#include <array>
#include <memory>
#include <string_view>

#include "tests/benchmarks/stair_scenes.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::bench {

// One scene with the state that its stages need. The map has seen the scene often enough to trust it.
struct Workbench {
  explicit Workbench(StairScene seen_scene);

  // The next exposure of the scene.
  [[nodiscard]] DepthFrameView next_frame() noexcept;
  // What makes the scene useless as a benchmark, empty when nothing does: a stage that finds nothing is fast.
  [[nodiscard]] std::string_view complaint() const noexcept;

  StairScene scene;
  std::int64_t now_ns = kNsPerS;
  std::unique_ptr<SurfaceExtractor> extractor = std::make_unique<SurfaceExtractor>();
  SurfaceFrame surfaces;
  std::unique_ptr<PolygonMap> map = std::make_unique<PolygonMap>();
  std::unique_ptr<FootholdSearch> search =
      std::make_unique<FootholdSearch>(FootholdSearch::Params{}, nominal_robot().sole);
  RawRange range;  // this and the next two: reduction and segments by themselves
  std::unique_ptr<ColumnImage> columns = std::make_unique<ColumnImage>();
  std::unique_ptr<ScanlineSegmentation> segments = std::make_unique<ScanlineSegmentation>();
  std::uint32_t sum = 0;
};

// On a frame's way through the extractor; some run more than once in a frame.
void stage_intake(Workbench& bench);
void stage_mask(Workbench& bench);
void stage_columns(Workbench& bench);  // reduction and segments, row by row
void stage_growing(Workbench& bench);
void stage_boundaries(Workbench& bench);       // segments to spans, who has which rows, change-points
void stage_refit(Workbench& bench);            // and facets that are joined
void stage_residual_planes(Workbench& bench);  // planes in what is left over
void stage_components(Workbench& bench);       // and their profiles
void stage_polygons(Workbench& bench);         // outlines, nosing and back lines, polygons
// By themselves.
void stage_streaming_floor(Workbench& bench);  // reads every pixel once: nothing that sees the whole frame is faster
void stage_reduction(Workbench& bench);
void stage_segments(Workbench& bench);
void stage_whole_frame(Workbench& bench);
void stage_map(Workbench& bench);
void stage_footholds(Workbench& bench);

struct Stage {
  std::string_view name;
  void (*run)(Workbench&);
};
enum ExtractorStage : std::size_t {
  kIntake,
  kMask,
  kColumnSegments,
  kGrowing,
  kBoundaries,
  kRefit,
  kResidualPlanes,
  kComponents,
  kPolygons
};
inline constexpr std::array<Stage, 9> kExtractorStages{{{"intake", stage_intake},
                                                        {"mask", stage_mask},
                                                        {"columns", stage_columns},
                                                        {"growing", stage_growing},
                                                        {"boundaries", stage_boundaries},
                                                        {"refit", stage_refit},
                                                        {"residual_planes", stage_residual_planes},
                                                        {"components", stage_components},
                                                        {"polygons", stage_polygons}}};
inline constexpr std::array<Stage, 6> kOtherStages{{{"whole_frame", stage_whole_frame},
                                                    {"streaming_floor", stage_streaming_floor},
                                                    {"reduction", stage_reduction},
                                                    {"segments", stage_segments},
                                                    {"map", stage_map},
                                                    {"footholds", stage_footholds}}};

// The stage that the extractor's next step belongs to.
[[nodiscard]] ExtractorStage extractor_stage(const SurfaceExtractor& extractor) noexcept;

// One frame through the extractor. around(stage) must call stage.run(bench), and may do so between two looks at a
// clock.
template <typename Around>
void extract_in_stages(Workbench& bench, const Around& around) {
  do {
    around(kExtractorStages[extractor_stage(*bench.extractor)]);
  } while (bench.extractor->busy());
}

}  // namespace polygmap::bench
