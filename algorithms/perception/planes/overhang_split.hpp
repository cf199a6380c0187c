// SPDX-License-Identifier: Apache-2.0
// A leaning plane that is two upright ones: the face of a nosing and, set back beneath it, the riser.
//
// Both are a few rows high, and one segment through both fits them hardly worse than the noise. Over their height
// they differ: how far away an upright surface is jumps once where a leaning one's distance rises evenly.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/core/work.hpp"
#include "algorithms/perception/image/frame_image.hpp"
#include "algorithms/perception/planes/plane_merging.hpp"
#include "algorithms/perception/planes/plane_set.hpp"

namespace polygmap {

class OverhangSplit {
 public:
  struct Params {
    double least_lean_rad = 0.04;
    double most_lean_rad = 0.5;
    // Chosen on nosings of 20 to 40 mm before hidden heights were left out: with 0.5 the least plane rate was 1 Hz
    // lower (2026-11). toolchain/campaign nosing has the least with what is here.
    double most_left = 0.9;
    double least_step_m = 0.005;
    std::int32_t least_rows = 30;
    double farthest_m = 0.06;
    // Between the two, where the riser lies in the nosing's shadow, a height has a tenth to a fifth of the rows of a
    // full one.
    double sparse = 0.3;
    double most_beyond = 0.1;

    static void visit(auto& p, auto& field) {
      field("least_lean_rad", p.least_lean_rad, 0.0, 0.5,
            "A plane that leans less from upright is upright: a step of 5 mm makes as much.");
      field("most_lean_rad", p.most_lean_rad, 0.1, 1.5,
            "A plane that leans more from upright is no pair of upright ones.");
      field("most_left", p.most_left, 0.0, 1.0,
            "A step leaves less than this share of what a slope leaves unexplained: 1 asks which explains more.");
      field("least_step_m", p.least_step_m, 0.001, 0.1, "The two upright planes are at least as far apart.");
      field("least_rows", p.least_rows, 4, 10000, "Each of the two shows as many rows of columns.");
      field("farthest_m", p.farthest_m, 0.001, 0.5, "A row farther from the plane's middle shows something else.");
      field("sparse", p.sparse, 0.0, 0.9,
            "A height with less than this share of the fullest height's rows shows a mixture of neighbours.");
      field("most_beyond", p.most_beyond, 0.0, 1.0,
            "A plane is no pair of upright ones when a larger share of its rows lies above or below all heights looked "
            "at.");
    }
  };
  struct Halves {
    InversePlane larger, smaller;  // by what they show
    double smaller_px = 0.0;
  };
  // The planes that lean are looked at; up: unit, camera frame.
  void begin(const Params& params, const Vec3& up, const PlaneSet& planes) noexcept;
  void add_column(const FrameImage& picture, std::int32_t column, const SpanBoundaries::Column& spans,
                  const PlaneMerging::PlaneIndex& to_plane) noexcept;
  [[nodiscard]] bool any() const noexcept { return count_ > 0; }
  // False where a plane does not lean, or leans as one.
  [[nodiscard]] bool try_split(std::size_t plane, Halves& halves) noexcept;
  [[nodiscard]] std::uint32_t overflow() const noexcept { return overflow_; }  // leaning planes without room

  [[nodiscard]] WorkCount& work() noexcept { return work_; }  // since it was last paid

 private:
  static constexpr std::size_t kMaxLeaning = 16;
  static constexpr std::int32_t kBins = 48;
  static constexpr double kBin_m = 0.008;
  struct Bin {
    float rows = 0.0F, distance_m = 0.0F;  // sum, from the plane's middle
  };
  struct Profile {
    Vec3 back = Vec3::UnitZ();  // level, away from the camera
    double middle_m = 0.0;      // distance of the plane's centre along it
    double lowest_m = 0.0;      // of the first bin, along up
    double drop = 0.0;          // of the line of sight to the plane's centre, per length along back
    double beyond = 0.0;        // rows above or below all bins
    std::array<Bin, kBins> bins{};
  };
  struct Step {
    std::int32_t first_upper = 0;
    double lower_m = 0.0, upper_m = 0.0;  // from the plane's middle
    double lower_rows = 0.0, upper_rows = 0.0;
    double left_m2 = 1e9;  // unexplained, summed over rows
  };
  void drop_sparse(Profile& profile) const noexcept;
  static void drop_hidden(const Step& step, Profile& profile) noexcept;
  [[nodiscard]] static double left_by_slope_m2(const Profile& profile) noexcept;
  [[nodiscard]] Step best_step(const Profile& profile) const noexcept;

  Params params_;
  Vec3 up_ = Vec3::UnitZ();
  std::array<Profile, kMaxLeaning> profiles_{};
  WorkCount work_;
  std::size_t count_ = 0;
  std::array<std::uint8_t, PlaneSet::kMaxPlanes + 1> profile_of_{};  // 1-based, 0 = does not lean
  std::uint32_t overflow_ = 0;
};

}  // namespace polygmap
