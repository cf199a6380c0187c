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

// Ranges around the data sheet. Sources: encoders of 14 bit behind a gear, joints of 1 to 3 Nm friction and 0.1 to 0.3
// degrees of play, six-axis sensors that drift by tens of newtons, soles of rubber on wood. Of the stairs: at scale 2
// each tread slopes and turns by 1.5 degrees and, with --jitter's 5 mm, each rise is off by 10 mm; the building code
// (IBC 1011.5) allows 1.2 degrees, 9.5 mm within a flight and nosings of 14 mm radius. Of the camera: 30 to 60 ms of
// latency, 2 % of frames lost in a busy USB hub, half of the seeds without sun. Strips along the nosings are 25 to 50
// mm wide or none: they are set alone.
constexpr auto kItems = std::to_array<RealityItem>({
    {"sensors.encoder_step_rad", Draw::kLevel, 0.0004},
    {"sensors.foot_force_noise_n", Draw::kLevel, 10.0},
    {"sensors.foot_force_offset_n", Draw::kEven, 30.0},
    {"sensors.foot_force_mass_kg", Draw::kLevel, 0.5},
    {"sensors.friction_nm", Draw::kLevel, -1.0},  // the leg feels it: plant.joint_friction_nm
    {"sensors.lio_drift_mps", Draw::kEven, 0.002},
    {"sensors.lio_drift_radps", Draw::kEven, 0.001},
    {"sensors.lio_walk_mprs", Draw::kLevel, 0.003},
    {"sensors.lio_sigma_scale", Draw::kEven, 0.3},
    {"sensors.depth_noise", Draw::kEven, 0.3},
    {"sensors.toe_m", Draw::kEven, 0.005},
    {"sensors.heel_m", Draw::kEven, 0.003},
    {"plant.friction", Draw::kEven, 0.2},
    {"plant.ground_s", Draw::kEven, 0.004},
    {"plant.armature_kgm2", Draw::kEven, 0.02},
    {"plant.joint_friction_nm", Draw::kLevel, 1.0},
    {"plant.joint_damping_nmsprad", Draw::kLevel, 0.2},
    {"plant.backlash_rad", Draw::kLevel, 0.002},
    {"plant.torque_scale", Draw::kEven, 0.05},
    {"plant.torque_lag_s", Draw::kLevel, 0.002},
    {"plant.torso_mass_scale", Draw::kEven, 0.03},
    {"plant.torso_offset_x_m", Draw::kEven, 0.010},
    {"camera.drop_share", Draw::kLevel, 0.02},
    {"camera.latency_s", Draw::kLevel, 0.02},
    {"camera.jitter_s", Draw::kLevel, 0.01},
    {"camera.reorder_share", Draw::kLevel, 0.005},
    {"camera.edge_fattening_px", Draw::kLevel, 0.5},
    {"camera.dark_share", Draw::kLevel, 0.1},
    {"camera.shiny_share", Draw::kLevel, 0.05},
    {"camera.sun_patch_m", Draw::kEven, 0.1},
    {"stairs.tread_slope_rad", Draw::kLevel, 0.0131},
    {"stairs.tread_cant_rad", Draw::kLevel, 0.0087},
    {"stairs.tread_yaw_rad", Draw::kLevel, 0.0131},
    {"stairs.rise_error_m", Draw::kLevel, 0.0025},
    {"stairs.worn_nosing_m", Draw::kLevel, 0.004},
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
      const double share = item.draw == Draw::kLevel  ? 1.0
                           : item.draw == Draw::kEven ? noise.uniform(n, -1.0, 1.0)
                                                      : noise.normal(n);
      if (scale > 0.0) number = math::clamp(number + scale * item.at_one * share, param.least, param.most);
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
