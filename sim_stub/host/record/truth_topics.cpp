// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/record/truth_topics.hpp"

#include <algorithm>
#include <string>

#include "firmware/recording/mcap/cdr_parts.hpp"

namespace polygmap::sim {
namespace {

using namespace mcap;  // what messages are put together from
using recording::Topic;

constexpr Color kStone{0.75, 0.74, 0.72, 1.0}, kThing{0.80, 0.47, 0.65, 1.0};

void put_cube(CdrWriter& out, const Transform& pose, const Vec3& size_m, const Color& color, const std::string& id) {
  begin_entity(out, 0, "true_world", id);
  put_no_primitives(out, 2);  // metadata, arrows
  out.put_count(1);
  put_pose(out, pose);
  put_vector(out, size_m);
  put_color(out, color);
  put_no_primitives(out, 6);
}

}  // namespace

void TruthTopics::send(Topic topic, std::int64_t stamp_ns, const CdrWriter& message) {
  if (!message.full()) recorder_.write(topic, stamp_ns, stamp_ns, message.bytes());
}

// A step as a block from the floor up to its tread.
void TruthTopics::write_stairs(std::int64_t now_ns) {
  const StairWorld& stairs = stairs_;
  CdrWriter out = message();
  const std::size_t steps = stairs.is_staircase ? stairs.steps.size() : 0;
  begin_scene(out, now_ns, steps + stairs.obstacles.size() + stairs.solids.size());
  for (const SolidBox& solid : stairs.solids) {
    const Step& top = stairs.steps[static_cast<std::size_t>(solid.step)];
    put_cube(out, solid.box().centre, 2.0 * solid.half_m(), top.is_walkable ? kStone : kThing, "solid " + top.name);
  }
  for (std::size_t i = 0; i < steps; ++i) {
    const Step& step = stairs.steps[i];
    const Vec3 middle_m{0.5 * (step.nosing_x_m + step.back_x_m), 0.0, 0.5 * step.height_m};
    const Vec3 size_m{step.back_x_m - step.nosing_x_m, 2.0 * stairs.half_width_m, step.height_m};
    const Transform own{Mat3::Identity(), middle_m};
    put_cube(out, step.true_T_step * own, size_m, kStone, "step " + std::to_string(i + 1));
  }
  for (std::size_t i = 0; i < stairs.obstacles.size(); ++i) {
    const Obstacle& obstacle = stairs.obstacles[i];
    put_cube(out, {Mat3::Identity(), obstacle.centre_m}, obstacle.size_m, kThing, "thing " + std::to_string(i + 1));
  }
  send(Topic::kStairs, now_ns, out);
}

void TruthTopics::write(const Truth& truth) {
  if (last_.stamp_ns == 0) write_stairs(truth.stamp_ns);
  CdrWriter out = message();
  put_header(out, truth.stamp_ns, "true_world");
  out.put_text("base");
  put_pose(out, truth.true_T_base);
  for (int i = 0; i < 36; ++i) out.put(0.0);
  const std::int64_t dt_ns = truth.stamp_ns - last_.stamp_ns;
  const Vec3 way_m = truth.true_T_base.p_m - last_.true_T_base.p_m;
  const bool has_speed = last_.stamp_ns != 0 && dt_ns > 0;
  put_vector(out, has_speed ? Vec3(truth.true_T_base.R.transpose() * way_m / seconds(dt_ns)) : Vec3(Vec3::Zero()));
  put_vector(out, Vec3::Zero());
  for (int i = 0; i < 36; ++i) out.put(0.0);
  send(Topic::kTruth, truth.stamp_ns, out);

  out = message();
  put_header(out, truth.stamp_ns, "true_world");
  out.put_count(truth.true_T_sole.size());
  for (const Transform& sole : truth.true_T_sole) put_pose(out, sole);
  send(Topic::kTruthFeet, truth.stamp_ns, out);
  last_ = truth;
}

void TruthTopics::write(const Preview& preview) {
  const std::vector<unsigned char> png = png_of(preview);
  CdrWriter out = message();
  put_header(out, preview.stamp_ns, "camera");
  out.put_text("png");
  out.put_bytes(std::as_bytes(std::span(png)));
  send(Topic::kPreview, preview.stamp_ns, out);
}

void TruthTopics::write_verdict(std::string_view json, std::int64_t now_ns) {
  CdrWriter out = message();
  out.put_text(json);
  send(Topic::kVerdict, now_ns, out);
}

}  // namespace polygmap::sim
