// SPDX-License-Identifier: Apache-2.0
// Where an image shows the toe of a standing foot, against where the encoders have it. Where a camera sits along the
// ground cannot be told from level surfaces, and a foothold is off by as much; the robot's own toe tells, whenever a
// standing leg is so straight that its knee does not hide it. The foot's shape is its collision box.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/depth_range.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

struct ToeDetectorParams {
  double most_off_m = 0.012;
  double least_jump_m = 0.015;  // eight sigma of a pixel
  double inlier_m = 0.003;
  std::int32_t min_lines = 4;
  double least_sigma_m = 0.0006;

  static void visit(auto& p, auto& field) {
    field("most_off_m", p.most_off_m, 0.0, 0.1,
          "A pixel on the foot's upper face is no farther, along the optical axis, from where that is believed.");
    field("least_jump_m", p.least_jump_m, 0.0, 0.2, "Beyond the toe the depth is larger than on it by as much.");
    field("inlier_m", p.inlier_m, 0.0, 0.05, "A line that ends nearer to the median of all lines shows the toe.");
    field("min_lines", p.min_lines, 1, 16, "As many of 16 lines across the foot show the toe.");
    field("least_sigma_m", p.least_sigma_m, 1e-6, 0.05,
          "The toe's place is taken for no better known: its edge runs along a row of pixels, and all lines round "
          "alike.");
  }
};

struct ToeSighting {
  double ahead_m = 0.0;  // by how much the toe is seen ahead of where the encoders have it, along the sole's x axis
  double sigma_m = 0.0;  // of the image alone
  Vec3 sole_p_edge_m = Vec3::Zero();  // middle of the upper edge that was seen, where the data sheet has it
};

// Follows lines along the foot's upper face over its front edge, beyond which depth jumps; nothing is seen where too
// few lines show one jump at one place, because the toe is hidden, out of the image or close to a riser.
class ToeDetector {
 public:
  // frame: of the size of the intrinsics; its pixels are read until done. camera_T_sole: at the exposure, by encoders
  // and the mount as believed.
  void begin(const ToeDetectorParams& params, const DepthFrameView& frame, const CameraIntrinsics& intrinsics,
             const RawRange& range, const SoleModel& sole, const Transform& camera_T_sole) noexcept;
  // Follows a line; true after the last.
  [[nodiscard]] bool step() noexcept;
  [[nodiscard]] std::optional<ToeSighting> sighting() noexcept;  // when it is done
  [[nodiscard]] WorkCount& work() noexcept { return work_; }     // since it was last paid

 private:
  // What lines are sampled at is compiled in: their arrays have these sizes.
  static constexpr int kLines = 16;         // across the foot, 6 mm apart: three pixels at 0.7 m
  static constexpr double kStep_m = 0.001;  // along a line; a pixel is 1.9 mm there
  static constexpr int kOnFoot = 12;        // steps on the foot before its end: a shank hides what lies farther back
  static constexpr int kBeyond = 6;         // steps past its end: what lies there a riser may hide after a centimetre
  static constexpr int kSearch = 14;        // the toe is looked for this far to both sides of where it is believed
  static constexpr int kSteps = kOnFoot + 2 * kSearch + kBeyond;
  // What is measured behind the upper face, m; not a number where nothing is.
  using Line = std::array<double, kSteps>;
  struct Excess;

  [[nodiscard]] static Excess excess_of(const Line& line, int first, int last) noexcept;
  void measure(const Vec3& from_m, int step, Line& line) noexcept;
  // Where a line leaves the foot, in steps; nothing when that is not seen.
  [[nodiscard]] std::optional<double> end_of_line(const Line& line) noexcept;

  ToeDetectorParams params_;
  DepthFrameView frame_;
  CameraIntrinsics intrinsics_;
  RawRange range_;
  Transform camera_T_sole_;
  Vec3 first_m_ = Vec3::Zero();  // the first line's middle would begin there, in the sole's frame
  double half_width_m_ = 0.0;
  int next_ = kLines;
  StaticVector<double, kLines> ends_m_;
  WorkCount work_;
};

}  // namespace polygmap
