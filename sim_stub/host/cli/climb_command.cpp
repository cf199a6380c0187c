// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/climb_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <ostream>

#include "firmware/config/operator_request_text.hpp"
#include "firmware/config/param_file.hpp"
#include "firmware/live/live_display.hpp"
#include "sim_stub/host/cli/can_command.hpp"
#include "sim_stub/host/cli/command_words.hpp"
#include "sim_stub/host/cli/estimate_command.hpp"
#include "sim_stub/host/cli/obstacle_options.hpp"
#include "sim_stub/host/cli/params_command.hpp"
#include "sim_stub/host/cli/paths.hpp"
#include "sim_stub/host/cli/perceive_command.hpp"
#include "sim_stub/host/cli/recording_commands.hpp"
#include "sim_stub/host/cli/world_options.hpp"
#include "sim_stub/host/operator/keyboard.hpp"
#include "sim_stub/host/output_file.hpp"
#include "sim_stub/sensors/virtual_clock.hpp"

namespace polygmap::sim {
namespace {

constexpr double kMaxLength_m = 2.0;
constexpr double kMinStep_m = 0.01;  // rise or tread
constexpr int kMaxSteps = 200;
constexpr double kTimeLimit_s = 60.0;        // simulated: walking up and ending, ...
constexpr double kTimeLimitPerStep_s = 6.0;  // ... and nearly twice what a step may take
constexpr double kFirstPush_s = seconds(VirtualClock::kStart_ns), kLastPush_s = 1000.0, kHardestPush_ns = 100.0;
constexpr double kQuietPeriod_s = 5.0;  // simulated, between progress lines of a log

struct ClimbArguments {
  ClimbOptions options;
  std::string noise = "white";
  std::string plant = name_of(ClimbOptions{}.plant);
  std::string gait = "ds";
  std::string contacts = "inferred";
  std::string record = "no-pictures";
  std::vector<double> render_shift_m;
  std::optional<int> missing_step;  // 1-based as people count
  std::string bus;
  bool no_self_filter = false;
  bool no_mount_estimate = false;
  std::string camera;
  std::vector<std::string> pushes;
  std::vector<std::string> set;
  bool keyboard = false;
  bool watch = false, json = false;
  std::vector<std::string> ask;
  Reality usual;  // of the options that are items of it
  double mount_error_deg = 1.0;
  const CLI::App* said = nullptr;  // which options were
};

// A length of the stairs.
void declare_length(CLI::App& climb, const char* name, double& length_m, double least_m, const char* text) {
  keep_within(*climb.add_option(name, length_m, text), least_m, kMaxLength_m, "m");
  climb.get_option(name)->capture_default_str();
}

void declare_stairs(CLI::App& climb, StairParams& stairs) {
  keep_within(*climb.add_option("--steps", stairs.steps, "Number of steps; the last one is the landing")
                   ->transform(CLI::Validator(decimal, ""))
                   ->capture_default_str(),
              1, kMaxSteps);
  declare_length(climb, "--rise", stairs.rise_m, kMinStep_m, "Rise of a step, m");
  declare_length(climb, "--tread", stairs.tread_m, kMinStep_m, "Depth of a tread, m");
  declare_length(climb, "--width", stairs.width_m, kMinStep_m, "Width of the staircase, m");
  declare_length(climb, "--nosing", stairs.nosing_m, 0.0,
                 "Overhang of a tread over its riser, m; shorter than the shortest tread");
  declare_obstacles(climb, stairs);
  declare_length(climb, "--landing", stairs.landing_m, kMinStep_m, "Depth of the landing, m");
  climb
      .add_option("--jitter", stairs.jitter_m,
                  "Rise and tread of each step differ by up to this much, m: from 0 to half of rise and tread")
      ->capture_default_str();
}

// What the robot truly is, where the module believes otherwise.
void declare_reality(CLI::App& climb, ClimbArguments& a) {
  MujocoPlant::Params& mujoco = a.usual.plant;
  a.options.reality_scale = 1.0;
  keep_within(
      *climb
           .add_option(
               "--reality", a.options.reality_scale,
               "How far the robot and its sensors are from the data sheet: 0 as it says, 1 as real ones "
               "are, 2 twice as bad; drawn by the seed, see docs/reference/reality.md. Without it, with --plant "
               "kinematic, 0")
           ->capture_default_str(),
      0.0, 2.0);
  climb
      .add_option("--set", a.set, "One number of --reality by its name, as in plant.friction=0.4; goes before all else")
      ->expected(1, 64)
      ->type_name("NAME=VALUE");
  keep_within(*climb
                   .add_option("--mass-scale", mujoco.torso_mass_scale,
                               "The torso's true mass over the mass that the module believes")
                   ->capture_default_str(),
              0.5, 2.0);
  keep_within(*climb
                   .add_option("--torso-offset-x", mujoco.torso_offset_x_m,
                               "How far the torso's centre of mass truly is ahead of where the module believes it, m")
                   ->capture_default_str(),
              -0.1, 0.1, "m");
  keep_within(*climb.add_option("--friction", mujoco.friction, "Friction of the soles on floor and stairs")
                   ->capture_default_str(),
              0.05, 2.0);
}

void declare_operator(CLI::App& climb, ClimbArguments& a) {
  CLI::Option* keys =
      climb.add_flag("--operator", a.keyboard,
                     "Nothing starts by itself: keys arm, start, pause and stop it, at the wall clock's speed");
  climb
      .add_option("--ask", a.ask,
                  "The same by a script: one of " + std::string(kWhatMayBeAsked) +
                      "; and at which simulated second, as in pause@12.5")
      ->expected(1, 64)
      ->excludes(keys)
      ->type_name("WHAT@S");
}

void declare_live(CLI::App& climb, ClimbArguments& a) {
  CLI::Option* watch = climb.add_flag(
      "--watch", a.watch,
      "State, step, rate, slack of each row, ages, next foothold and faults while it climbs: a table in place on a "
      "terminal, else a line each simulated second");
  climb
      .add_flag(
          "--json", a.json,
          "With --watch: an object each simulated second instead, see docs/reference/live-json.md; the verdict goes "
          "to the standard error")
      ->needs(watch);
  keep_within(
      *climb.add_option("--pace", a.options.pace,
                        "Simulated seconds in one of the wall clock's, at most: 1 is its speed; 0 as fast as it "
                        "can. With --operator 1 unless said otherwise"),
      0.0, 1000.0);
  climb
      .add_option(
          "--mailbox", a.options.mailbox,
          "Also write what it knows and plans into shared memory of this name, as in /polygmap, in every cycle: "
          "see docs/deploy.md")
      ->type_name("/NAME");
}

void declare_camera(CLI::App& climb, ClimbArguments& a) {
  climb
      .add_option("--camera", a.camera,
                  "The robot's camera, " + std::to_string(kDepthWidth_px) + "x" + std::to_string(kDepthHeight_px) +
                      " at most; the module is told what the file says")
      ->type_name("CAMERA.toml");
  keep_within(
      *climb
           .add_option("--scan-ms", a.options.scan_ms,
                       "Time from a picture's first row to its last, ms; the nearest of 0, 4, 8 ... is simulated")
           ->capture_default_str(),
      0.0, 32.0, "ms");
  keep_within(*climb
                   .add_option("--mount-error", a.mount_error_deg,
                               "How far the camera's mount may be off, unknown to the module: degrees about each axis, "
                               "and 3 mm for each degree")
                   ->capture_default_str(),
              0.0, 5.0, "degrees");
  keep_within(*climb
                   .add_option("--scale-error", a.usual.sensors.depth_scale,
                               "How far the depths' scale may be off, unknown to the module: share of the depth")
                   ->capture_default_str(),
              0.0, 0.05);
}

// What the camera shows may differ from what the robot stands on: shows that the module lives on what it sees.
void declare_causality(CLI::App& climb, ClimbArguments& a) {
  const std::string causality = "causality (experiments on what the module sees)";
  climb
      .add_option(
          "--render-shift", a.render_shift_m,
          "Shift of the rendered staircase, m, each from -" + number(kMaxLength_m) + " to " + number(kMaxLength_m))
      ->expected(3)
      ->type_name("X Y Z")
      ->group(causality);
  climb
      .add_option("--render-missing-step", a.missing_step,
                  "Leave step K out of the picture, from 1, the lowest, to --steps")
      ->transform(CLI::Validator(decimal, ""))
      ->type_name("INT")
      ->group(causality);
  climb.add_flag("--blank-depth", a.options.blank_depth, "The camera delivers no depth")->group(causality);
  climb.add_flag("--no-mount-estimate", a.no_mount_estimate, "The module believes the mount's data sheet")
      ->group(causality);
  climb.add_flag("--no-self-filter", a.no_self_filter, "The module does not mask its own legs")->group(causality);
}

void declare_files(CLI::App& climb, ClimbArguments& a) {
  climb.add_option("--out", a.options.out_dir, "Directory for summary.json and climb.svg")->capture_default_str();
  climb.add_flag(
      "--save-inputs", a.options.save_inputs,
      "Also write what the sensors said, for perceive and estimate: OUT/inputs/depth_NN.png, log.csv, lio.csv");
  keep_among(*climb
                  .add_option("--record", a.record,
                              "What OUT/run.mcap has, for replay, report and MCAP tools: all that goes into the module "
                              "and comes out of it, but pictures; all: pictures too; none: no file")
                  ->capture_default_str(),
             {"no-pictures", "all", "none"});
}

void declare(CLI::App& climb, ClimbArguments& a) {
  declare_stairs(climb, a.options.stairs);
  declare_worlds(climb, a.options);
  keep_among(
      *climb
           .add_option("--plant", a.plant,
                       "mujoco: under physics, it balances or falls; kinematic: follows and never tips over, quicker")
           ->capture_default_str(),
      {"mujoco", "kinematic"});
  keep_among(
      *climb
           .add_option("--gait", a.gait, "ds: both feet on every tread; ss: one foot on every tread, both on the last")
           ->capture_default_str(),
      {"ds", "ss"});
  climb.add_option("--seed", a.options.seed, "Draws the start, the steps' jitter, the robot's errors and all noise")
      ->check(whole_number)
      ->transform(CLI::Validator(decimal, ""))
      ->type_name("UINT in [0, 2^64 - 1]")
      ->capture_default_str();
  keep_among(*climb.add_option("--noise", a.noise, "Depth noise")->capture_default_str(), {"white", "correlated"});
  keep_among(*climb.add_option("--contacts", a.contacts, "Foot forces: inferred from joint torques, or sensed, too")
                  ->capture_default_str(),
             {"inferred", "sensed"});
  climb
      .add_option("--push", a.pushes,
                  "Pushes of the torso, over 0.1 s: when, from " + number(kFirstPush_s) + " to " + number(kLastPush_s) +
                      " s; along x (up the stairs) or y (to the left); how much, from -" + number(kHardestPush_ns) +
                      " to " + number(kHardestPush_ns) + " N s")
      ->expected(1, 16)
      ->type_name("\"T,AXIS,NS\"");
  declare_operator(climb, a);
  declare_live(climb, a);
  declare_reality(climb, a);
  declare_files(climb, a);
  declare_camera(climb, a);
  climb.add_option("--bus", a.bus, "The joints are behind CAN buses with the drives that this file describes")
      ->type_name("BUS.toml");
  climb.add_option("--can-log", a.options.can_log, "Also write every frame on the buses there, as candump -L has them")
      ->type_name("FILE");
  climb.add_option("--params", a.options.params_file, "Parameters of the module; other options go before what it says")
      ->type_name("PARAMS.toml");
  declare_causality(climb, a);
}

// As in "12.5,x,10"; nothing when it is no push.
std::optional<Push> read_push(const std::string& text) {
  Push push;
  char axis = 0;
  int end = 0;
  if (std::sscanf(text.c_str(), "%lf,%c,%lf%n", &push.at_s, &axis, &push.impulse_ns, &end) != 3) return {};
  if (end != static_cast<int>(text.size()) || (axis != 'x' && axis != 'y')) return {};
  if (!(push.at_s >= kFirstPush_s && push.at_s <= kLastPush_s && std::abs(push.impulse_ns) <= kHardestPush_ns)) {
    return {};
  }
  push.axis = axis == 'x' ? 0 : 1;
  return push;
}

// What the file says holds where no option says otherwise. Throws config::FileError.
void take_params(ClimbArguments& a) {
  if (a.options.params_file.empty()) return;
  Params& params = a.options.params;
  config::read_params(a.options.params_file, params);
  if (a.said->count("--gait") == 0) a.gait = name_of(params.gait.planner.pattern);
  a.no_self_filter |= !params.self_filter;
  a.no_mount_estimate |= !params.estimate_mount;
}

// Parts of complaint(): empty, or one sentence. Those that take all arguments complete the options.
std::string stairs_complaint(const StairParams& stairs) {
  const double most_jitter_m = 0.5 * std::min(stairs.rise_m, stairs.tread_m);
  if (!(stairs.jitter_m >= 0.0 && stairs.jitter_m <= most_jitter_m)) {
    return "--jitter must be from 0 to half of rise and tread, " + number(most_jitter_m) + " m, not " +
           number(stairs.jitter_m) + ".";
  }
  const double shortest_tread_m = stairs.tread_m - stairs.jitter_m;
  if (!(stairs.nosing_m < shortest_tread_m)) {
    return "--nosing must be shorter than the shortest tread, " + number(shortest_tread_m) + " m, not " +
           number(stairs.nosing_m) + ".";
  }
  return {};
}

std::string plant_complaint(ClimbArguments& a) {
  a.options.gait = a.gait == "ss" ? GaitPattern::kSingleStep : GaitPattern::kDoubleStep;
  a.options.plant = a.plant == "mujoco" ? PlantKind::kMujoco : PlantKind::kKinematic;
  a.options.foot_sensors = a.contacts == "sensed";
  return {};
}

// Throws config::FileError.
std::string world_complaint(ClimbArguments& a) { return take_world(*a.said, a.options); }

std::string balusters_complaint(ClimbArguments& a) {
  for (const char* name : {"--baluster-side", "--baluster-inset", "--baluster-size"}) {
    if (a.said->count(name) > 0 && a.said->count("--balusters") == 0) {
      return std::string(name) + " is of no use without --balusters.";
    }
  }
  return {};
}

std::string pushes_complaint(ClimbArguments& a) {
  if (!a.pushes.empty() && a.options.plant != PlantKind::kMujoco) {
    return "--push needs --plant mujoco: forces do not move the kinematic plant.";
  }
  for (const char* name : {"--mass-scale", "--torso-offset-x", "--friction"}) {
    if (a.said->count(name) == 0 || a.options.plant == PlantKind::kMujoco) continue;
    return std::string(name) + " needs --plant mujoco: the kinematic plant has neither masses nor friction.";
  }
  for (const std::string& text : a.pushes) {
    const std::optional<Push> push = read_push(text);
    if (!push) {
      return "--push must be a time from " + number(kFirstPush_s) + " to " + number(kLastPush_s) +
             " s, x or y and from -" + number(kHardestPush_ns) + " to " + number(kHardestPush_ns) +
             " N s, as in 12.5,x,10, not \"" + text + "\".";
    }
    a.options.pushes.push_back(*push);
  }
  return {};
}

std::string operator_complaint(ClimbArguments& a) {
  for (const std::string& text : a.ask) {
    TimedRequest request;
    const std::string sentence = read_request(text, request);
    if (!sentence.empty()) return sentence;
    if (!a.options.asked.empty() && request.at_s < a.options.asked.back().at_s) {
      return "--ask must be in the order of time: \"" + text + "\" comes after a later one.";
    }
    a.options.asked.push_back(request);
  }
  if (a.options.comes_back && (a.keyboard || !a.options.asked.empty())) {
    return "--back sends the robot itself: no --operator and no --ask beside it.";
  }
  const bool is_sent = a.options.world && a.options.world->world.goal;  // which arms it, too
  if (!a.options.params.supervisor.autostart && !a.keyboard && a.options.asked.empty() && !is_sent) {
    return "Parameter file \"" + a.options.params_file +
           "\" switches supervisor.autostart off, and there is no --operator and no --ask: it would never arm.";
  }
  return {};
}

std::string reality_complaint(ClimbArguments& a) {
  Reality& reality = a.options.reality;
  const auto said = [&a](const char* name) { return a.said->count(name) > 0; };
  if (!said("--reality") && a.options.plant != PlantKind::kMujoco) a.options.reality_scale = 0.0;
  reality = draw_reality(a.options.reality_scale, a.options.seed);
  if (said("--mass-scale")) reality.plant.torso_mass_scale = a.usual.plant.torso_mass_scale;
  if (said("--torso-offset-x")) reality.plant.torso_offset_x_m = a.usual.plant.torso_offset_x_m;
  if (said("--friction")) reality.plant.friction = a.usual.plant.friction;
  if (said("--scale-error")) reality.sensors.depth_scale = a.usual.sensors.depth_scale;
  if (said("--mount-error")) {
    reality.sensors.camera_mount_rad = a.mount_error_deg * kPi / 180.0;
    reality.sensors.camera_mount_m = 0.003 * a.mount_error_deg;
  }
  for (const std::string& assignment : a.set) {
    if (assignment.starts_with("plant.") && a.options.plant != PlantKind::kMujoco) {
      return "--set " + assignment + " needs --plant mujoco: the kinematic plant has neither masses nor friction.";
    }
    const std::string sentence = set_item(reality, assignment);
    if (!sentence.empty()) return sentence;
  }
  return {};
}

std::string errors_complaint(ClimbArguments& a) {
  a.options.noise = a.noise == "white" ? NoiseKind::kWhite : NoiseKind::kCorrelated;
  return {};
}

// Throws config::FileError.
std::string camera_complaint(ClimbArguments& a) {
  if (a.camera.empty()) return {};
  a.options.camera = config::read_camera(a.camera);
  a.options.camera_file = a.camera;
  const CameraIntrinsics& k = a.options.camera->intrinsics;
  if (k.width_px > kDepthWidth_px || k.height_px > kDepthHeight_px || k.width_px % 2 != 0 || k.height_px % 2 != 0) {
    return "Camera file \"" + a.camera + "\": the robot's camera is at most " + std::to_string(kDepthWidth_px) + "x" +
           std::to_string(kDepthHeight_px) + ", width and height even, not " + std::to_string(k.width_px) + "x" +
           std::to_string(k.height_px) + ".";
  }
  return {};
}

// Throws config::FileError.
std::string bus_complaint(ClimbArguments& a) {
  if (a.bus.empty()) return a.options.can_log.empty() ? "" : "--can-log needs --bus: without one there are no frames.";
  a.options.bus = config::read_bus(a.bus);
  const bool has_feet = a.options.bus->table.feet.present;
  if (a.said->count("--contacts") == 0) a.options.foot_sensors = has_feet;
  if (a.options.foot_sensors && !has_feet) {
    return "--contacts sensed needs [feet] in \"" + a.bus + "\": its buses carry no foot forces.";
  }
  RobotModel robot = a.options.params.robot;
  config::limit_by_drives(*a.options.bus, robot);
  if (a.options.can_log.empty()) return {};
  for (const std::string& taken : {a.bus, a.camera, a.options.params_file, a.options.out_dir + "/summary.json",
                                   a.options.out_dir + "/climb.svg", a.options.out_dir + "/run.mcap"}) {
    if (one_name(taken) == one_name(a.options.can_log)) return "\"" + taken + "\" would be overwritten by --can-log.";
  }
  std::ofstream probe(a.options.can_log);
  return probe ? "" : "Cannot write the file \"" + a.options.can_log + "\" given by --can-log.";
}

std::string picture_complaint(ClimbArguments& a) {
  const StairParams& stairs = a.options.stairs;
  if (a.missing_step) {
    if (*a.missing_step < 1 || *a.missing_step > stairs.steps) {
      return "--render-missing-step must be a step from 1 to " + std::to_string(stairs.steps) + ", not " +
             std::to_string(*a.missing_step) + ".";
    }
    a.options.render_missing_step = *a.missing_step - 1;
  }
  if (!a.render_shift_m.empty()) {
    for (const double shift_m : a.render_shift_m) {
      if (!(std::abs(shift_m) <= kMaxLength_m)) {
        return "--render-shift must be three lengths within +-" + number(kMaxLength_m) + " m, not " + number(shift_m) +
               ".";
      }
    }
    a.options.render_dx_m = a.render_shift_m[0];
    a.options.render_dy_m = a.render_shift_m[1];
    a.options.render_dz_m = a.render_shift_m[2];
  }
  return {};
}

// Empty when the arguments are good, else one sentence. Completes the options.
std::string complaint(ClimbArguments& a) {
  try {
    take_params(a);
    std::string sentence = stairs_complaint(a.options.stairs);
    for (const auto part : {balusters_complaint, plant_complaint, world_complaint, pushes_complaint, operator_complaint,
                            errors_complaint, reality_complaint, camera_complaint, bus_complaint, picture_complaint}) {
      if (sentence.empty()) sentence = part(a);
    }
    if (!sentence.empty()) return sentence;
  } catch (const config::FileError& error) {
    return error.what();
  }
  a.options.self_filter = !a.no_self_filter;
  a.options.estimate_mount = !a.no_mount_estimate;
  constexpr double kWorldLimit_s = 300.0;
  if (a.options.world) a.options.time_limit_s = kWorldLimit_s;
  a.options.time_limit_s =
      std::max(a.options.time_limit_s, kTimeLimit_s + kTimeLimitPerStep_s * a.options.stairs.steps);
  return {};
}

std::string output_complaint(const ClimbOptions& options) {
  const std::string& directory = options.out_dir;
  const bool with_inputs = options.save_inputs;
  if (directory.empty()) return "--out must name a directory.";
  std::string complaint = directory_complaint(directory);
  if (complaint.empty() && with_inputs) complaint = directory_complaint(directory + "/inputs");
  if (!complaint.empty()) return complaint;
  try {  // what a former run left is none of this one's
    for (const char* name : {"summary.json", "climb.svg", "run.mcap", "report.html"})
      remove_output(directory + "/" + name);
    write_drawn_world(options);
    if (with_inputs) {
      for (const auto& entry : std::filesystem::directory_iterator(directory + "/inputs")) {
        const std::string name = entry.path().filename().string();
        const bool picture = name.starts_with("depth_") && name.ends_with(".png");
        if (picture || name == "log.csv" || name == "lio.csv") remove_output(entry.path().string());
      }
    }
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

class ProgressLine {
 public:
  ProgressLine(std::ostream& out, int steps, bool live) : out_(out), steps_(steps), live_(live) {}

  void show(const ClimbProgress& p) {
    if (!live_ && p.time_s < next_s_) return;
    next_s_ = p.time_s + kQuietPeriod_s;
    char line[160];
    const std::string of = steps_ > 0 ? " of " + std::to_string(steps_) : "";
    std::snprintf(line, sizeof line, "%6.1f s  step %d%s  %-16.*s worst row %s %.0f us (host)", p.time_s,
                  p.treads_climbed, of.c_str(), static_cast<int>(p.phase.size()), p.phase.data(), p.worst_row,
                  p.worst_row_us);
    out_ << (live_ ? "\r" : "") << line << (live_ ? "\x1b[K" : "\n") << std::flush;
    shown_ = true;
  }
  void end() {
    if (live_ && shown_) out_ << "\n";
  }

 private:
  std::ostream& out_;
  int steps_;
  bool live_;
  bool shown_ = false;
  double next_s_ = 0.0;
};

}  // namespace

int polygmap_main(const std::vector<std::string>& arguments, const ClimbRunner& run, std::ostream& out,
                  std::ostream& err, bool live, const std::atomic<int>* interrupt) {
  CLI::App app("PolygMap-RT: a humanoid climbs stairs that it sees.", "polygmap");
  app.require_subcommand(0, 1);
  app.set_version_flag("--version", "polygmap " POLYGMAP_PROGRAM_VERSION, "Print the version and exit");
  app.footer(
      "Exit codes: 0 pass or done, 1 the climb failed or the replay differs, 2 a bad argument, file or output, 130 or "
      "143 interrupted.");
  CLI::App* climb = app.add_subcommand(
      "climb", "Climb a simulated staircase; writes summary.json and climb.svg, exit code 0 only on pass");
  ClimbArguments a;
  a.options.out_dir = "climb_out";
  declare(*climb, a);
  a.said = climb;
  PerceiveArguments perceive_arguments;
  CLI::App* perceive = declare_perceive(app, perceive_arguments);
  EstimateArguments estimate_arguments;
  CLI::App* estimate = declare_estimate(app, estimate_arguments);
  RecordingArguments recording_arguments;
  declare_recording_commands(app, recording_arguments);
  ParamsArguments params_arguments;
  CLI::App* params = declare_params(app, params_arguments);
  CanArguments can_arguments;
  CLI::App* can = declare_can(app, can_arguments);
  std::vector<CLI::App*> commands(recording_arguments.commands.begin(), recording_arguments.commands.end());
  commands.insert(commands.end(), {climb, perceive, estimate, params_arguments.list, params_arguments.diff,
                                   can_arguments.encode, can_arguments.decode, can_arguments.dbc});
  for (CLI::App* command : commands) {
    for (CLI::Option* option : command->get_options()) option->check(not_empty);
  }

  try {
    std::vector<std::string> last_first(arguments.rbegin(), arguments.rend());  // as CLI11 wants them
    for (std::string& word : last_first) {                                      // and -.9 is an option to it
      if (word.size() > 2 && word[0] == '-' && word[1] == '.' && word[2] >= '0' && word[2] <= '9') word.insert(1, "0");
    }
    app.parse(std::move(last_first));
  } catch (const CLI::Success& success) {
    app.exit(success, out, err);
    return written(out, err);
  } catch (const CLI::ParseError& error) {
    err << "polygmap: " << complaint_of(error, app, arguments) << "; see " << command_of(app) << "--help.\n";
    return kExitUsage;
  }
  if (perceive->parsed()) return run_perceive(perceive_arguments, out, err, interrupt);
  if (estimate->parsed()) return run_estimate(estimate_arguments, out, err, interrupt);
  if (const auto code = run_recording_command(recording_arguments, out, err)) return *code;
  if (can->parsed()) return run_can(can_arguments, out, err);
  if (params->parsed()) return run_params(params_arguments, out, err);
  if (!climb->parsed()) {  // asked for here: CLI11 would not name a subcommand that it does not know
    err << "polygmap: A subcommand is required; see polygmap --help.\n";
    return kExitUsage;
  }
  std::string sentence = complaint(a);
  if (sentence.empty()) sentence = output_complaint(a.options);
  if (a.record != "none" && !a.options.out_dir.empty()) a.options.recording = a.options.out_dir + "/run.mcap";
  a.options.record_pictures = a.record == "all";
  a.options.command = {"polygmap"};
  a.options.command.insert(a.options.command.end(), arguments.begin(), arguments.end());
  if (!sentence.empty()) {
    err << "polygmap: " << sentence << "\n";
    return kExitUsage;
  }

  std::optional<ScriptedOperator> script;
  std::optional<Keyboard> keyboard;
  std::optional<LiveDisplay> display;
  std::optional<NoteBuffer> notes;
  if (a.watch) {
    using Form = LiveDisplay::Form;
    display.emplace(out, a.json ? Form::kJson : live && is_terminal() ? Form::kTable : Form::kLines);
    a.options.display = &*display;
    if (!a.json) notes.emplace(*display);
  }
  std::ostream words(notes ? &*notes : err.rdbuf());
  if (!a.options.asked.empty()) a.options.climb_operator = &script.emplace(a.options.asked, words);
  if (a.keyboard) a.options.climb_operator = &keyboard.emplace(words);
  if (a.keyboard && a.said->count("--pace") == 0) a.options.pace = 1.0;
  ProgressLine progress(out, a.options.world ? 0 : a.options.stairs.steps, live && a.options.climb_operator == nullptr);
  ClimbSummary summary;
  std::string not_written;
  try {
    const ClimbProgressFunction show = [&progress](const ClimbProgress& p) { progress.show(p); };
    summary = run(a.options, a.watch ? ClimbProgressFunction{} : show);
  } catch (const ClimbNotWritten& error) {
    summary = error.summary;
    not_written = error.what();
  } catch (const std::exception& error) {  // no memory, no thread for the camera
    progress.end();
    err << "polygmap: " << error.what() << "\n";
    return kExitUsage;
  }
  progress.end();
  (a.json ? err : out) << verdict_line(summary) << "\n" << std::flush;
  if (!out && not_written.empty()) not_written = "Cannot write the verdict to the standard output.";
  if (!not_written.empty()) {
    err << "polygmap: " << not_written << "\n";
    return kExitUsage;
  }
  const std::string report = a.options.out_dir + "/report.html";
  if (std::error_code none; std::filesystem::exists(report, none)) (a.json ? err : out) << report << "\n" << std::flush;
  if (summary.interrupted_by != 0) return kExitSignal + summary.interrupted_by;
  return summary.pass ? kExitPass : kExitFail;
}

}  // namespace polygmap::sim
