// SPDX-License-Identifier: Apache-2.0
// Lidar odometry as relative poses: where its world lies is a clone of the base's place and heading when the
// two were tied, and every later pose corrects the filter against that, as of its own stamp. So velocity, tilt and
// biases gain from it.
//
// What lidar odometry moves the filter by at once, in place and heading, odom does not follow: odometry goes on without
// a step, and so do the footholds that live in it. Where odom lies in the world is eqs (5)-(10)'s to say (LioFusion).
#pragma once

#include "algorithms/estimation/filters/contact_inekf.hpp"

namespace polygmap {

class LidarTie {
 public:
  struct Params {
    bool as_rows = true;
    double tilt_sigma_rad = 0.003;
    double walk_mprs = 0.03;
    double walk_radprs = 3e-4;
    double most_ratio = 5.0;
    std::int32_t most_denied = 10;

    static void visit(auto& p, auto& field) {
      field("as_rows", p.as_rows,
            "Besides the offset, by eqs (5)-(10), poses correct the odometry's velocity, tilt and biases.");
      field("tilt_sigma_rad", p.tilt_sigma_rad, 0.0, 0.2, "Lidar odometry's world is level but for this.");
      field("walk_mprs", p.walk_mprs, 0.0, 1.0,
            "Its world drifts like this: one of 2 to 20 mm/s is not to move the footholds.");
      field("walk_radprs", p.walk_radprs, 0.0, 1.0, "Its heading drifts like this.");
      field("most_ratio", p.most_ratio, 1.0, 1e6,
            "A pose whose squared innovation is more than this times its variance, per row, contradicts the legs.");
      field("most_denied", p.most_denied, 1, 1000000,
            "After so many of them in a row lidar odometry has jumped, and its world is tied anew.");
    }
  };
  void reset(const Params& params) noexcept {
    *this = LidarTie{};
    params_ = params;
  }
  // The next pose ties the two worlds anew.
  void untie() noexcept { tied_ = false; }
  // A pose of lidar odometry's, of its stamp, at which odometry had the base at odom_T_base; age_s: of the stamp. True
  // where it moved the filter; then moved says by what, in place and heading.
  [[nodiscard]] bool try_correct(const Transform& odom_T_base, const Transform& lidar_T_base, std::int64_t stamp_ns,
                                 double age_s, double position_sigma_m, double yaw_sigma_rad, ContactInEkf& filter,
                                 Transform& moved) noexcept;
  [[nodiscard]] const Transform& filter_T_odom() const noexcept { return filter_T_odom_; }

 private:
  Params params_;
  Transform filter_T_odom_;
  bool tied_ = false;
  std::int32_t denied_ = 0;
  std::int64_t stamp_ns_ = 0;
};

}  // namespace polygmap
