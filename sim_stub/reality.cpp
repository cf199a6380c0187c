// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/reality.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "firmware/config/param_file.hpp"
#include "firmware/config/param_table.hpp"
#include "sim_stub/camera/counter_noise.hpp"

namespace polygmap::sim {
namespace {

constexpr RealityItem always(std::string_view name, double more) { return {name, more, more}; }
constexpr RealityItem around(std::string_view name, double half) { return {name, -half, half}; }

// Ranges around the data sheet. Sources: encoders of 14 bit behind a gear, joints of 1 to 3 Nm friction and 0.1 to 0.3
// degrees of play, six-axis sensors that drift by tens of newtons, soles of rubber on wood, a lidar that is mounted by
// hand and an odometry that loses its place in a stairwell and finds it again. Of the stairs: with --jitter's 5 mm each
// rise is off by 10 mm; the building code (IBC 1011.5) allows 1.2 degrees, 9.5 mm within a flight and nosings of 14 mm
// radius. Of the camera: 20 to 100 ms of latency, 2 % of frames lost in a busy USB hub, half of the seeds without sun,
// half without strips along the nosings. Of the drives: a battery has a tenth more than its
// nominal voltage when it is full and a tenth less when it is empty. What is drawn around 0 and cannot be less is 0 for
// half of the seeds. At scale 2 every robot is held as softly as it may be.
constexpr auto kItems = std::to_array<RealityItem>({
    around("sensors.leg_length", 0.002),
    around("sensors.encoder_offset_rad", 0.0006),
    around("sensors.encoder_noise_rad", 0.0001),
    always("sensors.encoder_step_rad", 0.0004),
    around("sensors.joint_rate_noise_radps", 0.001),
    around("sensors.imu_mount_rad", 0.001),
    around("sensors.gyro_bias_radps", 0.001),
    around("sensors.gyro_noise_radps", 0.001),
    around("sensors.accel_bias_mps2", 0.02),
    around("sensors.accel_noise_mps2", 0.02),
    around("sensors.torque_noise_nm", 0.2),
    always("sensors.foot_force_noise_n", 10.0),
    around("sensors.foot_force_offset_n", 30.0),
    always("sensors.foot_force_mass_kg", 0.5),
    always("sensors.friction_nm", -1.0),  // the leg feels it: plant.joint_friction_nm
    around("sensors.lio_position_m", 0.004),
    around("sensors.lio_rotation_rad", 0.0015),
    always("sensors.lio_mount_rad", 0.006),
    always("sensors.lio_mount_m", 0.005),
    around("sensors.lio_drift_mps", 0.002),
    around("sensors.lio_drift_radps", 0.001),
    always("sensors.lio_walk_mprs", 0.003),
    around("sensors.lio_sigma_scale", 0.3),
    around("sensors.lio_jump_m", 0.06),
    around("sensors.lio_jump_s", 10.0),
    around("sensors.lio_outage_s", 5.0),
    around("sensors.lio_outage_from_s", 10.0),
    around("sensors.depth_noise", 0.3),
    around("sensors.toe_m", 0.005),
    around("sensors.heel_m", 0.003),
    around("sensors.sole_width_m", 0.004),
    around("plant.friction", 0.2),
    around("plant.ground_s", 0.004),
    around("plant.armature_kgm2", 0.02),
    always("plant.joint_friction_nm", 1.0),
    always("plant.joint_damping_nmsprad", 0.2),
    always("plant.backlash_rad", 0.002),
    around("plant.torque_scale", 0.05),
    always("plant.torque_lag_s", 0.002),
    around("plant.command_delay_s", 0.004),
    around("plant.torso_mass_scale", 0.03),
    around("plant.torso_offset_x_m", 0.010),
    around("plant.leg_mass_scale", 0.05),
    always("camera.drop_share", 0.02),
    {"camera.latency_s", -0.01, 0.07},
    always("camera.jitter_s", 0.01),
    always("camera.reorder_share", 0.005),
    around("camera.scan_s", 0.004),
    around("camera.focal_share", 0.003),
    around("camera.centre_px", 2.0),
    always("camera.edge_fattening_px", 0.5),
    always("camera.dark_share", 0.1),
    always("camera.shiny_share", 0.05),
    around("camera.nosing_strip_m", 0.025),
    around("camera.sun_patch_m", 0.1),
    always("stairs.tread_slope_rad", 0.0262),
    always("stairs.tread_cant_rad", 0.0087),
    always("stairs.tread_yaw_rad", 0.0262),
    always("stairs.rise_error_m", 0.005),
    always("stairs.worn_nosing_m", 0.004),
    around("plant.no_load_scale", 0.1),
    {"plant.holder_kp_nmprad", -1800.0, -1000.0},
    around("plant.torso_offset_y_m", 0.005),
    around("plant.torso_offset_z_m", 0.02),
    around("plant.inertia_scale", 0.1),
    around("sensors.gyro_scale", 0.003),
    around("sensors.accel_scale", 0.003),
    {"sensors.imu_delay_s", 0.0, 0.004},
    around("sensors.foot_force_scale", 0.05),
    around("sensors.foot_force_delay_s", 0.004),
    around("sensors.lio_delay_s", 0.03),
    around("sensors.lio_stamp_s", 0.005),
    around("camera.stamp_s", 0.005),
    {"sensors.toe_round_m", 0.0, 0.02},
    {"sensors.sole_edge_m", 0.0, 0.004},
});

std::span<double> numbers_of(config::Param& param) {
  if (double** one = std::get_if<double*>(&param.value)) return {*one, 1};
  if (std::span<double>* several = std::get_if<std::span<double>>(&param.value)) return *several;
  return {};
}

}  // namespace

std::span<const RealityItem> reality_items() noexcept { return kItems; }

Reality draw_reality(double scale, std::uint64_t seed) {
  Reality reality;
  config::ParamTable table = config::param_table(reality);
  const CounterNoise noise(seed, Stream::kReality);
  constexpr std::uint64_t kMostNumbers = 8;  // of an item
  for (std::size_t i = 0; i < kItems.size(); ++i) {
    const RealityItem& item = kItems[i];
    config::Param& param = *std::ranges::find(table.params, item.name, &config::Param::name);
    std::uint64_t n = i * kMostNumbers;
    for (double& number : numbers_of(param)) {
      const double more = noise.uniform(n, item.least, item.most);
      if (scale > 0.0) number = math::clamp(number + scale * more, param.least, param.most);
      ++n;
    }
  }
  return reality;
}

std::string set_item(Reality& reality, const std::string& assignment) {
  if (assignment.find('=') == std::string::npos || assignment.find('\n') != std::string::npos) {
    return config::without_controls("--set must be NAME=VALUE, as in plant.friction=0.4, not \"" + assignment + "\".");
  }
  Reality changed = reality;
  try {
    config::ParamTable table = config::param_table(changed);
    table.listed_by = "polygmap params reality";
    config::parse_params({"", "--set " + assignment}, assignment, table);
  } catch (const config::FileError& error) {
    return error.what();
  }
  reality = changed;
  return {};
}

std::vector<NamedValue> values_of(const Reality& reality) {
  Reality copy = reality;
  std::vector<NamedValue> values;
  for (const config::Param& param : config::param_table(copy).params) {
    values.push_back({param.name, config::text_of(param)});
  }
  return values;
}

}  // namespace polygmap::sim
