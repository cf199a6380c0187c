// SPDX-License-Identifier: Apache-2.0
// The plan, of what the gait, the map and the search for footholds know.
#include "firmware/link/plan_reading.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "firmware/link/readings.hpp"

namespace polygmap::link {
namespace {

static_assert(POLYGMAP_MAX_STEPS == decltype(GaitPlan::steps)::capacity());
static_assert(POLYGMAP_BODY_SAMPLES == GaitPlan::kSamples);
static_assert(POLYGMAP_MAX_POLYGONS == kMaxMapPolygons && POLYGMAP_MAX_VERTICES == kMaxPolygonVertices);
static_assert(POLYGMAP_STEP_EXPECTED == static_cast<int>(StepCertainty::kExpected));
static_assert(POLYGMAP_SURFACE_OTHER == static_cast<int>(SurfaceKind::kOther));
static_assert(POLYGMAP_MAX_CONTACTS >= 2 * POLYGMAP_MAX_STEPS + 1);

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
constexpr polygmap_transform kNowhere{{kNotKnown, kNotKnown, kNotKnown}, {kNotKnown, kNotKnown, kNotKnown, kNotKnown}};

polygmap_foot_target target_of(const InstanceClock& clock, const PlannedStep& step) noexcept {
  polygmap_foot_target to{};
  to.foot = static_cast<std::int32_t>(step.foot);
  to.certainty = static_cast<std::int32_t>(step.certainty);
  to.lift_off_ns = clock.to_caller_or_0(step.lift_off_ns);
  to.touch_down_ns = clock.to_caller_or_0(step.touch_down_ns);
  to.x_m = step.target_m.x();
  to.y_m = step.target_m.y();
  to.z_m = step.target_m.z();
  to.yaw_rad = step.yaw_rad;
  copy(step.up, to.up);
  to.torso_x_m = to.torso_y_m = to.torso_z_m = to.torso_yaw_rad = kNotKnown;
  to.polygon_id = step.polygon_id;
  to.onto_tread = step.onto_tread ? 1 : 0;
  to.returns = step.returns ? 1 : 0;
  return to;
}

polygmap_body body_of(const InstanceClock& clock, const PlannedBody& body) noexcept {
  polygmap_body to{};
  to.time_ns = clock.to_caller(body.stamp_ns);
  copy(body.p_com_m, to.com_m);
  copy(body.v_com_mps, to.com_mps);
  to.zmp_m[0] = body.zmp_m.x();
  to.zmp_m[1] = body.zmp_m.y();
  copy(body.p_base_m, to.torso_m);
  to.torso_yaw_rad = body.base_yaw_rad;
  return to;
}

// From now on: both feet, or the one, until the next step's foot lifts, then without it until it lands.
void list_contacts(const InstanceClock& clock, const GaitPlan& plan, const std::array<bool, kFootCount>& stands,
                   polygmap_plan& to) noexcept {
  const auto add = [&](std::int64_t begin_ns, bool left, bool right) {
    if (to.contact_count > 0) to.contact[to.contact_count - 1].end_ns = begin_ns;
    to.contact[to.contact_count++] = {
        begin_ns, std::numeric_limits<std::int64_t>::max(), {left ? 1U : 0U, right ? 1U : 0U}};
  };
  add(clock.to_caller(plan.stamp_ns), stands[0], stands[1]);
  for (const PlannedStep& step : plan.steps) {
    if (step.touch_down_ns == 0) return;
    const bool is_left = step.foot == Foot::kLeft;
    if (step.lift_off_ns > plan.stamp_ns) add(clock.to_caller(step.lift_off_ns), !is_left, is_left);
    add(clock.to_caller(step.touch_down_ns), true, true);
  }
}

polygmap_stairs stairs_of(const ControlLane& control) noexcept {
  const FootholdSet& found = control.footholds();
  const GaitStatus& gait = control.gait_status();
  polygmap_stairs to{};
  to.state = found.has_p_star ? POLYGMAP_STAIRS_APPROACHING : POLYGMAP_STAIRS_NONE;
  if (gait.treads_climbed > 0 || gait.step.onto_tread) to.state = POLYGMAP_STAIRS_CLIMBING;
  if (gait.phase == GaitPhase::kFinished) to.state = POLYGMAP_STAIRS_ON_TOP;
  to.climbed = gait.treads_climbed;
  // Where the search has measured nothing it says 0.
  to.rise_m = found.measured_rise_m != 0.0 ? found.measured_rise_m : kNotKnown;
  to.tread_m = found.measured_tread_m > 0.0 ? found.measured_tread_m : kNotKnown;
  to.heading_rad = found.has_p_star ? found.p_star.yaw_rad : kNotKnown;
  std::fill_n(&to.nosing_m[0][0], 6, kNotKnown);
  if (!found.has_p_star) return to;
  copy(found.tread.nosing_a_m, to.nosing_m[0]);
  copy(found.tread.nosing_b_m, to.nosing_m[1]);
  return to;
}

polygmap_polygon polygon_of(const InstanceClock& clock, const MapPolygon& from, const Vec3& drift_m) noexcept {
  const SurfacePatch& surface = from.surface;
  polygmap_polygon to{};
  to.id = from.id;
  to.surface = static_cast<std::int32_t>(surface.kind);
  to.sightings = from.sightings;
  to.vertices = static_cast<std::uint32_t>(surface.polygon.size());
  to.last_seen_ns = clock.to_caller_or_0(from.last_seen_ns);
  copy(surface.normal, to.normal);
  to.offset_sigma_m = surface.offset_sigma_m;
  for (std::size_t i = 0; i < surface.polygon.size(); ++i) {
    copy(surface.polygon[i] + drift_m, to.vertex_m[i]);
    to.observed[i] = surface.edges[i] == EdgeKind::kObserved ? 1 : 0;
  }
  to.has_nosing = surface.nosing.valid ? 1 : 0;
  if (!surface.nosing.valid) return to;
  copy(surface.nosing.a_m + drift_m, to.nosing_m[0]);
  copy(surface.nosing.b_m + drift_m, to.nosing_m[1]);
  return to;
}

}  // namespace

void read_steps(const PlanSource& source, const InstanceClock& clock, polygmap_plan& to) noexcept {
  const GaitStatus& gait = source.control.gait_status();
  GaitPlan plan;
  source.control.tell_plan(plan);

  to.phase = static_cast<std::int32_t>(gait.phase);
  to.stamp_ns = clock.to_caller(source.cycle_ns);
  to.map_stamp_ns = clock.to_caller_or_0(source.map.stamp_ns);
  to.held = plan.planned && plan.held ? 1 : 0;
  to.stairs = stairs_of(source.control);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    to.foot[foot] = {plan.planned ? transform_of(plan.odom_T_sole[foot]) : kNowhere, gait.stands[foot] ? 1U : 0U};
  }
  to.step_count = to.contact_count = to.body_count = 0;
  for (const PlannedStep& step : plan.steps) to.step[to.step_count++] = target_of(clock, step);
  if (plan.has_landing) {
    to.step[0].torso_x_m = plan.landing.p_base_m.x();
    to.step[0].torso_y_m = plan.landing.p_base_m.y();
    to.step[0].torso_z_m = plan.landing.p_base_m.z();
    to.step[0].torso_yaw_rad = plan.landing.base_yaw_rad;
  }
  for (const PlannedBody& body : plan.bodies) to.body[to.body_count++] = body_of(clock, body);
  if (plan.planned) list_contacts(clock, plan, gait.stands, to);
}

void read_polygons(const PlanSource& source, const InstanceClock& clock, polygmap_plan& to) noexcept {
  to.polygon_count = 0;
  for (const MapPolygon& polygon : source.map.polygons) {
    to.polygon[to.polygon_count++] = polygon_of(clock, polygon, source.map.drift_m);
  }
}

bool read_plan(const Instance& instance, polygmap_plan& to) noexcept {
  if (instance.executive->lane_statistics().cycles == 0) return false;
  const PlanSource source{instance.pipeline->control(), instance.watched.map.front(),
                          instance.executive->last_cycle().due_ns};
  read_steps(source, instance.clock, to);
  read_polygons(source, instance.clock, to);
  return true;
}

}  // namespace polygmap::link
