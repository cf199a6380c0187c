// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/perception_stages.hpp"

#include <utility>

namespace polygmap::bench {
namespace {

constexpr std::int64_t kFramePeriod_ns = 33 * kNsPerMs;
constexpr int kSightings = 10;
constexpr std::size_t kLeastSurfaces = 3;

void extract(Workbench& bench) {
  const DepthFrameView frame = bench.next_frame();
  if (!bench.extractor->try_begin(frame, bench.scene.view)) return;
  WorkBudget whole_frame(SurfaceExtractor::kMaxUnitsPerFrame);
  static_cast<void>(bench.extractor->step(whole_frame));
}

void fuse(Workbench& bench) {
  bench.surfaces.stamp_ns = bench.now_ns += kFramePeriod_ns;
  bench.scene.map_view.columns = &bench.extractor->segmenter().image().columns;
  bench.map->begin(bench.surfaces, bench.scene.map_view);
  WorkBudget whole_frame(1 << 20);
  static_cast<void>(bench.map->step(whole_frame));
}

void find_footholds(Workbench& bench) {
  bench.search->begin(bench.map->snapshot(), bench.scene.query);
  WorkBudget whole_search(1 << 20);
  static_cast<void>(bench.search->step(whole_search));
}

void reduce(Workbench& bench) {
  const CameraIntrinsics& k = bench.scene.view.intrinsics;
  for (std::int32_t r = 0; r < k.height_px; ++r) {
    reduce_to_columns(bench.range, bench.scene.depth.data() + static_cast<std::ptrdiff_t>(r) * k.width_px, nullptr,
                      k.width_px / kColumn_px, bench.columns->inverse_depth.row(r), bench.columns->valid.row(r));
  }
}

ExtractorStage plane_stage(const PlaneExtractor& planes) noexcept {
  using Part = PlaneExtractor::Part;
  switch (planes.part()) {
    case Part::kGrowing:
    case Part::kMergingGrown:
      return kGrowing;
    case Part::kSharpening:
    case Part::kMeasuring:
      return planes.fit_part() == SpanFit::Part::kSums ? kRefit : kBoundaries;
    case Part::kSolvingSharpened:
    case Part::kMergingSharpened:
    case Part::kSolvingMeasured:
    case Part::kPlacing:
    case Part::kFacets:
    case Part::kOverhangs:
      return kRefit;
    case Part::kResidual:
      return kResidualPlanes;
    case Part::kDone:
      break;
  }
  return kComponents;
}

// As long as the extractor's next step belongs to that stage; a budget of one unit is one piece of work.
void run_through(Workbench& bench, ExtractorStage stage) {
  do {
    WorkBudget piece(1);
    static_cast<void>(bench.extractor->step(piece));
  } while (bench.extractor->busy() && extractor_stage(*bench.extractor) == stage);
}

}  // namespace

Workbench::Workbench(StairScene seen_scene) : scene(std::move(seen_scene)) {
  range.set(DepthLimits{}, scene.view.intrinsics.depth_unit_m);
  extract(*this);
  surfaces = extractor->result();
  for (int i = 0; i < kSightings; ++i) fuse(*this);
  find_footholds(*this);
  reduce(*this);
}

DepthFrameView Workbench::next_frame() noexcept {
  now_ns += kFramePeriod_ns;
  return {now_ns, 0, scene.view.intrinsics.width_px, scene.view.intrinsics.height_px, scene.depth.data()};
}

std::string_view Workbench::complaint() const noexcept {
  if (surfaces.surfaces.size() < kLeastSurfaces) return "the extractor finds hardly a surface";
  if (map->snapshot().polygons.size() < kLeastSurfaces) return "the map keeps hardly a polygon";
  // The map sees the same noise again and again, which leaves an edge as uncertain as one look does.
  const StopReason obstruction = search->result().obstruction;
  if (obstruction != StopReason::kNone && obstruction != StopReason::kEdgeUncertain) {
    return "the search finds no next tread";
  }
  return {};
}

ExtractorStage extractor_stage(const SurfaceExtractor& extractor) noexcept {
  using At = SurfaceExtractor::Stage;
  switch (extractor.stage()) {
    case At::kIdle:
      return kIntake;
    case At::kSegments:
      return extractor.segmenter().part() == Segmenter::Part::kMask ? kMask : kColumnSegments;
    case At::kPlanes:
      return plane_stage(extractor.plane_extractor());
    case At::kRegions:
      return kComponents;
    case At::kSurfaces:
    case At::kThings:
    case At::kFinish:
      return kPolygons;
  }
  return kPolygons;
}

void stage_intake(Workbench& bench) {
  static_cast<void>(bench.extractor->try_begin(bench.next_frame(), bench.scene.view));
}
void stage_mask(Workbench& bench) { run_through(bench, kMask); }
void stage_columns(Workbench& bench) { run_through(bench, kColumnSegments); }
void stage_growing(Workbench& bench) { run_through(bench, kGrowing); }
void stage_boundaries(Workbench& bench) { run_through(bench, kBoundaries); }
void stage_refit(Workbench& bench) { run_through(bench, kRefit); }
void stage_residual_planes(Workbench& bench) { run_through(bench, kResidualPlanes); }
void stage_components(Workbench& bench) { run_through(bench, kComponents); }
void stage_polygons(Workbench& bench) { run_through(bench, kPolygons); }

void stage_streaming_floor(Workbench& bench) {
  std::uint32_t sum = 0;
  for (const std::uint16_t raw : bench.scene.depth) sum += raw;
  bench.sum += sum;
}
void stage_reduction(Workbench& bench) { reduce(bench); }
void stage_segments(Workbench& bench) {
  const CameraIntrinsics& k = bench.scene.view.intrinsics;
  bench.segments->begin({}, {}, k, *bench.columns);
  for (std::int32_t r = 0; r < k.height_px; r += ScanlineSegmentation::kBlock)
    bench.segments->add_rows(r, r + ScanlineSegmentation::kBlock - 1);
  bench.segments->finish();
}
void stage_whole_frame(Workbench& bench) { extract(bench); }
void stage_map(Workbench& bench) { fuse(bench); }
void stage_footholds(Workbench& bench) { find_footholds(bench); }

}  // namespace polygmap::bench
