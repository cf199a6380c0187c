// SPDX-License-Identifier: Apache-2.0
// Every piece of work of pictures, of the map that remembers them and of the search in it, marked one by one: what
// toolchain/checks/pieces counts. Arguments: raw pictures of 640 x 480 depths of 0.25 mm. Beside them: stairs with legs
// in the picture, in both noises, and clutter of tilted tiles that fills runs, planes and the map.
#include <cstdio>
#include <memory>
#include <vector>

#include "algorithms/foothold/foothold_search.hpp"
#include "algorithms/perception/map/polygon_map.hpp"
#include "algorithms/perception/surface_extractor.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/benchmarks/piece_marker.hpp"
#include "tests/support/depth_scene.hpp"
#include "tests/support/tiled_depths.hpp"

namespace polygmap::bench {
namespace {

using Raw = std::vector<std::uint16_t>;
// Labels: a row's, and what its step begins with; nothing at all, which is what a mark itself takes; a new picture.
constexpr std::int64_t kNothing = 0, kSurfaces = 1000, kMap = 2000, kFootholds = 3000, kPicture = 9000;
constexpr int kRepeats = 3;  // of every picture: a map that knows its surfaces is another one's work

test::DepthScene stairs_with_legs() {
  test::DepthScene scene;
  scene.intrinsics = robot_camera_intrinsics();
  scene.place_camera(0.77, 0.85, 0.0, 0.01);
  test::StairSpec stairs;
  stairs.first_riser_x_m = 0.25;
  scene.add_stairs(stairs);
  const RobotModel robot;
  LegVector swing = LegVector::Zero();
  swing[2] = -1.15, swing[3] = 1.5;  // hip pitch, knee
  const Transform camera_T_base = robot.mounts.base_T_camera.inverse();
  scene.legs[0] = transformed(camera_T_base, base_leg_shapes(robot, Foot::kLeft, swing));
  scene.legs[1] = transformed(camera_T_base, base_leg_shapes(robot, Foot::kRight, LegVector::Zero()));
  return scene;
}

std::int64_t label_of(const SurfaceExtractor& extractor) {
  using Stage = SurfaceExtractor::Stage;
  const auto in = [](Stage stage, auto part) {
    return kSurfaces + 100 * static_cast<std::int64_t>(stage) + static_cast<std::int64_t>(part);
  };
  switch (extractor.stage()) {
    case Stage::kSegments:
      return in(Stage::kSegments, extractor.segmenter().part());
    case Stage::kPlanes: {
      const auto fit = static_cast<std::int64_t>(extractor.plane_extractor().fit_part());
      return in(Stage::kPlanes, 7 * static_cast<std::int64_t>(extractor.plane_extractor().part()) + fit);
    }
    case Stage::kRegions:
      return in(Stage::kRegions, extractor.region_labeler().part());
    case Stage::kSurfaces:
      return in(Stage::kSurfaces, extractor.surface_builder().part());
    case Stage::kIdle:
    case Stage::kThings:
    case Stage::kFinish:
      break;
  }
  return in(extractor.stage(), 0);
}

// One piece after the other, until the work is done.
template <typename Step, typename Label>
void run_marked(const Step& step, const Label& label) {
  Progress progress = Progress::kBusy;
  while (progress == Progress::kBusy) {
    WorkBudget piece(1);
    const std::int64_t name = label();
    piece_begins();
    progress = step(piece);
    piece_ends(name, 1 - piece.left());
  }
}

class Bench {
 public:
  explicit Bench(const test::DepthScene& scene) : scene_(scene) {}

  void see(const Raw& raw) {
    for (int i = 0; i < kRepeats; ++i) see_once(raw);
  }

 private:
  void see_once(const Raw& raw) {
    stamp_ns_ += 33'000'000;
    piece_begins();
    piece_ends(kPicture, 0);
    SurfaceExtractor::View view;
    view.intrinsics = scene_.intrinsics;
    view.camera_up = scene_.camera_up();
    view.body = scene_.legs;
    const CameraIntrinsics& k = scene_.intrinsics;
    if (!extractor_->try_begin({stamp_ns_, 1, k.width_px, k.height_px, raw.data()}, view)) return;
    run_marked([&](WorkBudget& b) { return extractor_->step(b); }, [&] { return label_of(*extractor_); });
    PolygonMap::View seen;
    seen.odom_T_camera = scene_.world_T_camera;
    seen.intrinsics = k;
    seen.body = scene_.legs;
    seen.columns = &extractor_->segmenter().image().columns;
    seen.stands = {true, true};
    seen.sole = SoleModel{}.contact;
    map_->begin(extractor_->result(), seen);
    run_marked([&](WorkBudget& b) { return map_->step(b); },
               [&] { return kMap + static_cast<std::int64_t>(map_->stage()); });
    FootholdSearch::Query query;
    query.odom_T_base.p_m = {0.0, 0.0, 0.75};
    query.odom_T_sole[0].p_m = {0.0, 0.1, 0.0};
    query.odom_T_sole[1].p_m = {0.0, -0.1, 0.0};
    search_->begin(map_->snapshot(), query);
    run_marked([&](WorkBudget& b) { return search_->step(b); },
               [&] { return kFootholds + static_cast<std::int64_t>(search_->stage()); });
  }

  const test::DepthScene& scene_;
  std::int64_t stamp_ns_ = 0;
  SoleModel sole_;
  std::unique_ptr<SurfaceExtractor> extractor_ = std::make_unique<SurfaceExtractor>();
  std::unique_ptr<PolygonMap> map_ = std::make_unique<PolygonMap>();
  std::unique_ptr<FootholdSearch> search_ = std::make_unique<FootholdSearch>(FootholdSearch::Params{}, sole_);
};

int run(int count, char** files) {
  for (int i = 0; i < 8; ++i) {
    piece_begins();
    piece_ends(kNothing, 0);
  }
  const test::DepthScene scene = stairs_with_legs();
  Bench bench(scene);
  for (const bool correlated : {false, true}) {
    test::DepthPicture picture = test::render(scene);
    test::add_noise(picture, {.correlated = correlated}, 7);
    bench.see(picture.raw());
  }
  bench.see(test::tiled_depths(scene.intrinsics, 64, 48, false, 1));
  bench.see(test::tiled_depths(scene.intrinsics, 32, 32, false, 2));
  bench.see(test::tiled_depths(scene.intrinsics, 80, 40, true, 3));
  bench.see(test::tiled_depths(scene.intrinsics, 640, 20, true, 4));
  for (int i = 0; i < count; ++i) {
    Raw raw(static_cast<std::size_t>(kDepthWidth_px) * kDepthHeight_px);
    std::FILE* file = std::fopen(files[i], "rb");
    const bool whole = file != nullptr && std::fread(raw.data(), sizeof(raw[0]), raw.size(), file) == raw.size();
    if (file != nullptr) std::fclose(file);
    if (!whole) {
      std::fprintf(stderr, "perception_pieces: %s is no raw picture of 640 x 480 depths\n", files[i]);
      return 1;
    }
    bench.see(raw);
  }
  return 0;
}

}  // namespace
}  // namespace polygmap::bench

int main(int argc, char** argv) { return polygmap::bench::run(argc - 1, argv + 1); }
