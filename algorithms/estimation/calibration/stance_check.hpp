// SPDX-License-Identifier: Apache-2.0
// Whether IMU and legs agree about a robot that stands on both feet on level floor: the soles are parallel there, and
// their normal points where the IMU feels up. An IMU that is turned about the vertical is not noticed.
#pragma once

#include "algorithms/robot/robot_model.hpp"

namespace polygmap {

class StanceCheck {
 public:
  // Per axis, as docs/reference/reality.md has the errors: the IMU's mount 3.5 mrad, its bias (50 of 9810 mm/s^2)
  // 5.1 mrad, encoders of 2 mrad, three of which tell a sole's pitch, 3.5 mrad for one leg and 2.5 mrad for both. So
  // gravity errs by 6.7 mrad against the mean of the soles, and the soles by 4.9 mrad against each other.
  struct Params {
    double most_soles_rad = 0.06;
    double most_gravity_rad = 0.07;
    double most_strength_mps2 = 0.5;

    static void visit(auto& p, auto& field) {
      // 4.5 sigma where all errors are twice as large, 44 mrad, and a floor that is 1 deg steeper under one foot.
      field("most_soles_rad", p.most_soles_rad, 0.01, 3.2,
            "Arming: the soles' normals are no farther apart, or an encoder's zero or sign is wrong.");
      // 4.5 sigma where all errors are twice as large, 60 mrad; or 4.5 sigma, 30 mrad, and a floor that slopes by 2
      // deg.
      field("most_gravity_rad", p.most_gravity_rad, 0.01, 3.2,
            "Arming: gravity is no farther from the soles' mean normal, or the IMU's mount is not as configured.");
      field("most_strength_mps2", p.most_strength_mps2, 0.01, 10.0,
            "Arming: the IMU feels gravity as strong as it is to within this, ten times what a bias may be.");
    }
  };
  // Angles, 0 to pi.
  struct Leans {
    double soles_rad = 0.0;    // between their normals
    double gravity_rad = 0.0;  // between what the IMU feels and the mean of those
  };

  // base_accel_mps2: the mean of some time at rest.
  [[nodiscard]] static Leans leans(const LegGeometry& legs, const JointVector& q_rad,
                                   const Vec3& base_accel_mps2) noexcept;
};

}  // namespace polygmap
