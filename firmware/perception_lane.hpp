// SPDX-License-Identifier: Apache-2.0
// Frame intake, surfaces, map, footholds: resumable, whenever a frame is there.
#pragma once

#include "algorithms/core/work.hpp"
#include "algorithms/perception/extrinsics/camera_extrinsics.hpp"
#include "algorithms/perception/extrinsics/toe_detector.hpp"
#include "algorithms/perception/image/picture_monitor.hpp"
#include "firmware/lane_link.hpp"
#include "firmware/params.hpp"
#include "hal/ports/depth_camera.hpp"

namespace polygmap {

class PerceptionLane {
 public:
  PerceptionLane(hal::DepthCamera& camera, ControlPerceptionLink& link, LaneHealth& health,
                 const Params& params) noexcept;
  void watch(PerceptionTelemetry& watcher) noexcept { watcher_ = &watcher; }

  // Takes a frame from the driver, asks for the pose at its exposure, and starts the extraction when it is known. Gives
  // the frame back where it is not, and tells control of this lane's faults.
  Progress intake(std::int64_t now_ns) noexcept;
  Progress surfaces(std::int64_t now_ns, WorkBudget& budget) noexcept;
  Progress map(std::int64_t now_ns, WorkBudget& budget) noexcept;
  Progress footholds(std::int64_t now_ns, WorkBudget& budget) noexcept;

  [[nodiscard]] const SurfaceFrame& surface_frame() const noexcept { return extractor_.result(); }
  [[nodiscard]] const MapSnapshot& map_snapshot() const noexcept { return map_.snapshot(); }
  [[nodiscard]] const CameraExtrinsicsEstimator& mount() const noexcept { return mount_; }
  [[nodiscard]] const SurfaceExtractor& extractor() const noexcept { return extractor_; }
  [[nodiscard]] const PictureMonitor& pictures() const noexcept { return pictures_; }
  [[nodiscard]] const PolygonMap& polygon_map() const noexcept { return map_; }
  [[nodiscard]] const FootholdSearch& foothold_search() const noexcept { return search_; }
  [[nodiscard]] const Health& faults() const noexcept { return health_.own; }  // of this lane
  [[nodiscard]] const FootholdSet& footholds_found() const noexcept { return search_.result(); }
  [[nodiscard]] const LaneView& view() const noexcept { return view_; }

 private:
  enum class FrameStage : std::uint8_t { kWaiting, kPoseAsked, kExtracting, kLearning };

  void look_across(std::int64_t now_ns) noexcept;
  void begin_extraction(std::int64_t now_ns) noexcept;
  void begin_map(std::int64_t now_ns) noexcept;
  void judge_picture(std::int64_t now_ns) noexcept;
  [[nodiscard]] RawRange depth_range() const noexcept;
  void begin_learning() noexcept;
  void begin_toe() noexcept;
  [[nodiscard]] bool learn_some(WorkBudget& budget) noexcept;  // of the mount; true when the picture says no more
  void finish_picture(std::int64_t now_ns) noexcept;
  void begin_search() noexcept;

  hal::DepthCamera& camera_port_;
  ControlPerceptionLink& link_;
  LaneHealth& health_;
  PerceptionTelemetry* watcher_ = nullptr;  // none on a robot that nobody watches
  const Params& params_;
  CameraIntrinsics intrinsics_;

  // The next frame is extracted while the last one is still being searched.
  LaneView view_;
  FrameStage stage_ = FrameStage::kWaiting;
  struct {
    bool mapping = false, search_due = false, searching = false;
  } pending_;
  DepthFrameView frame_;
  StateEstimate exposure_state_;
  std::array<LegShapes, kFootCount> body_{};  // camera frame, at the exposure
  std::int64_t last_frame_ns_ = -1;           // taken; from the start until there is one
  std::uint32_t request_ = 0;                 // number of the last pose request
  SurfaceExtractor extractor_;
  PictureMonitor pictures_;
  CameraExtrinsicsEstimator mount_;
  struct {  // what the picture says of the mount, and all of them of the legs
    CameraExtrinsicsEstimator::Stance stance;
    ToeDetector toe;
    std::size_t foot = 0;  // whose toe it is
    WayScale way;
  } learning_;
  PolygonMap map_;
  FootholdSearch search_;
};

}  // namespace polygmap
