// SPDX-License-Identifier: Apache-2.0
// Where the centre of mass goes while the zero-moment point follows a plan: the linear inverted pendulum, solved in
// closed form between the plan's knots, from any motion to rest over the last of them.
#pragma once

#include <array>

#include "algorithms/core/containers/static_vector.hpp"
#include "algorithms/gait/trajectories/motion.hpp"

namespace polygmap {

// The zero-moment point is here at this tick and moves straight from knot to knot.
struct ZmpKnot {
  std::int32_t tick = 0;
  Vec2 zmp_m = Vec2::Zero();
};
inline constexpr std::size_t kMaxZmpKnots = 8;
using ZmpKnots = StaticVector<ZmpKnot, kMaxZmpKnots>;

class ComPlan {
 public:
  struct Params {
    double omega_radps = 3.5;
    std::int32_t zmp_offset_ticks = 200;
    double offset_up = 0.15, offset_down = 0.75;

    static void visit(auto& p, auto& field) {
      field("omega_radps", p.omega_radps, 1.0, 10.0, "Natural frequency of the body over its feet, sqrt(g / 0.80 m).");
      field("zmp_offset_ticks", p.zmp_offset_ticks, 20, 2000,
            "The zero-moment point leaves its way for so long to meet the start's motion.");
      field("offset_up", p.offset_up, 0.1, 0.45,
            "The zero-moment point is off its way in full from this share of the time.");
      field("offset_down", p.offset_down, 0.5, 0.95,
            "The zero-moment point goes back to its way from this share of the time.");
    }
  };

  [[nodiscard]] static Vec2 zmp_under(const Params& params, const HorizontalMotion& com) noexcept {
    return com.position_m - com.acceleration_mps2 / math::square(params.omega_radps);
  }
  // knots: at ticks > 0 that rise, at least one; after the last one everything rests. from: at tick 0. The zero-moment
  // point starts under `from`'s acceleration. What the pendulum would need of speed at the start and does not have is
  // made up by an offset: the zero-moment point leaves its straight way for zmp_offset_ticks.
  void plan(const Params& params, const HorizontalMotion& from, const ZmpKnots& knots) noexcept;
  // How far it would leave its way with such a plan, without making the plan.
  [[nodiscard]] static double zmp_offset_m(const Params& params, const HorizontalMotion& from,
                                           const ZmpKnots& knots) noexcept;
  [[nodiscard]] HorizontalMotion at(std::int32_t tick) const noexcept;
  [[nodiscard]] Vec2 zmp_m(std::int32_t tick) const noexcept;

 private:
  // x(t) = p + s t + a e^(w (t - T)) + b e^(-w t), T the duration: neither exponential overflows.
  struct Segment {
    std::int32_t begin = 0;
    std::int32_t ticks = 1;
    Vec2 zmp_m = Vec2::Zero();
    Vec2 slope_mps = Vec2::Zero();
    Vec2 a_m = Vec2::Zero();
    Vec2 b_m = Vec2::Zero();
  };
  static constexpr std::size_t kSegments = kMaxZmpKnots + 4;  // three for the offset, one at rest
  using Knots = StaticVector<ZmpKnot, kSegments>;
  [[nodiscard]] static Knots with_offset_knots(const Params& params, const Vec2& start_m, const ZmpKnots& knots,
                                               double offset_ticks) noexcept;
  // The knots of both together, moved by the offset, which it writes.
  [[nodiscard]] static Knots offset_knots(const Params& params, const HorizontalMotion& from, const ZmpKnots& knots,
                                          Vec2& offset_m) noexcept;
  [[nodiscard]] const Segment& segment(std::int32_t tick) const noexcept;

  std::array<Segment, kSegments> segments_;
  std::size_t count_ = 0;
  double omega_radps_ = 1.0;
};

}  // namespace polygmap
