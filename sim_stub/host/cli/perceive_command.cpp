// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/perceive_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <ostream>
#include <set>
#include <utility>

#include "firmware/config/param_file.hpp"
#include "firmware/params.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/cli/command_words.hpp"
#include "sim_stub/host/cli/paths.hpp"
#include "sim_stub/host/output_file.hpp"
#include "sim_stub/host/perceive/frame_page.hpp"
#include "sim_stub/host/perceive/perceive.hpp"
#include "sim_stub/host/perceive/perceived_picture.hpp"

namespace polygmap::sim {
namespace {

constexpr int kMaxRepeat = 100000;
constexpr const char *kLabels = ".labels.png", *kPlanes = ".planes.json", *kPicture = ".picture.png", *kPage = ".html";

// Where one picture's output goes: OUT itself, or NAME + suffix in the folder OUT when there are several pictures.
std::string place(const std::string& out, const std::string& depth, bool several, const char* suffix) {
  if (!several) return out;
  return (std::filesystem::path(out) / (std::filesystem::path(depth).stem().string() + suffix)).string();
}

// The files that are written of one picture.
std::vector<std::string> outputs_of(const PerceiveArguments& a, const std::string& depth) {
  std::vector<std::string> files;
  for (const auto& [out, suffix] : {std::pair{&a.labels, kLabels}, std::pair{&a.json, kPlanes},
                                    std::pair{&a.picture, kPicture}, std::pair{&a.html, kPage}}) {
    if (!out->empty()) files.push_back(place(*out, depth, a.depth.size() > 1, suffix));
  }
  return files;
}

std::string complaint(const PerceiveArguments& a) {
  if (a.depth.size() > 1 && !(a.labels + a.json + a.picture + a.html).empty()) {
    std::set<std::string> names;
    for (const std::string& path : a.depth) {
      const std::string name = std::filesystem::path(path).stem().string();
      if (!names.insert(name).second)
        return "Two pictures are called \"" + name + "\": one would overwrite the other's output.";
    }
  }
  // Nothing that is read, and nothing written for another option, is overwritten.
  std::set<std::string> taken{one_name(a.camera)};
  if (!a.params.empty()) taken.insert(one_name(a.params));
  for (const std::string& path : a.depth) taken.insert(one_name(path));
  for (const std::string& path : a.depth) {
    for (const std::string& file : outputs_of(a, path)) {
      if (!taken.insert(one_name(file)).second) return "\"" + file + "\" would be overwritten.";
    }
  }
  if (a.gravity.empty()) return {};
  const double norm = std::hypot(a.gravity[0], a.gravity[1], a.gravity[2]);
  if (!(norm > 1e-6) || !(norm < 1e6)) return "--gravity must be three finite numbers, not all zero.";
  return {};
}

void make_folders(const std::vector<std::string>& folders) {
  for (const std::string& folder : folders) {
    if (folder.empty()) continue;
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!std::filesystem::is_directory(folder, error))
      throw config::FileError("Cannot create the folder \"" + folder + "\".");
  }
}

struct Tuning {
  std::string hash;
  polygmap_frames::Values values;
};
// Of the surfaces' parameters, but for noise and range, which the camera's file says. Throws config::FileError.
Tuning tuning_of(const PerceiveArguments& a) {
  Params params, defaults;
  if (!a.params.empty()) config::read_params(a.params, params);
  const config::ParamTable table = config::param_table(params), usual = config::param_table(defaults);
  const std::string surfaces = "surfaces.";
  Tuning tuning{config::hash_of(table), {}};
  for (std::size_t i = 0; i < table.params.size(); ++i) {
    const config::Param& param = table.params[i];
    if (!param.name.starts_with(surfaces) || config::same_value(param, usual.params[i])) continue;
    const std::string name = param.name.substr(surfaces.size());
    if (name.starts_with("noise.") || name.starts_with("limits.")) continue;
    tuning.values.emplace_back(name, config::number_of(param));
  }
  return tuning;
}

// The line that says what was found; what is doubtful goes to err. Throws config::FileError.
std::string one_picture(const PerceiveArguments& a, const config::CameraProfile& camera, const Tuning& tuning,
                        const std::string& path, bool several, std::ostream& err, const std::atomic<int>* interrupt) {
  const DepthPng picture = read_depth(path);
  const std::string own = size_text(picture.width_px, picture.height_px);
  const std::string expected = size_text(camera.intrinsics.width_px, camera.intrinsics.height_px);
  if (own != expected)
    throw config::FileError("\"" + path + "\" is " + own + ", but the camera file says " + expected + ".");
  std::optional<Vec3> gravity;
  if (!a.gravity.empty()) gravity = Vec3{a.gravity[0], a.gravity[1], a.gravity[2]};
  Perceived perceived = perceive(camera, picture, gravity, a.repeat, tuning.values, interrupt);
  throw_if_interrupted(interrupt);  // once the first file is written, the others follow
  if (!a.labels.empty()) write_labels(place(a.labels, path, several, kLabels), picture, perceived);
  if (!a.json.empty()) write_planes(place(a.json, path, several, kPlanes), perceived, tuning.hash);
  if (!a.picture.empty()) write_picture(place(a.picture, path, several, kPicture), camera, picture, perceived);
  if (!a.html.empty())
    write_frame_page(place(a.html, path, several, kPage), path, camera, picture, perceived, tuning.hash);
  std::vector<double>& times = perceived.microseconds;
  std::sort(times.begin(), times.end());
  const Vec3& up = perceived.camera_up;
  if (const std::string doubt = doubt_of(perceived); !doubt.empty()) {
    err << "polygmap: warning: \"" << path << "\": " << doubt << "\n";
  }
  const std::string source = name_of(perceived.up_source) +
                             std::string(perceived.up_source == UpSource::kAssumed ? ": no plane looks level" : "");
  char line[192];
  std::snprintf(line, sizeof line, ": %zu planes, median %.0f us, max %.0f us, up (%.3f, %.3f, %.3f) %s\n",
                perceived.planes.size(), times[times.size() / 2], times.back(), up.x(), up.y(), up.z(), source.c_str());
  return path + line;
}

}  // namespace

CLI::App* declare_perceive(CLI::App& app, PerceiveArguments& a) {
  CLI::App* perceive = app.add_subcommand("perceive", "Find the planes in depth pictures (PNG, 16 bits)");
  perceive->add_option("DEPTH.png", a.depth, "Depth pictures")->required()->type_name("");
  perceive
      ->add_option(
          "--camera", a.camera,
          "width, height, fx, fy, cx, cy (px), depth_unit_m; optional: min_depth_m, max_depth_m, noise_base_m, "
          "noise_per_metre, noise_quadratic_per_m, noise_correlated_share, noise_correlated_px")
      ->required()
      ->type_name("CAMERA.toml");
  perceive
      ->add_option(
          "--gravity", a.gravity,
          "Down in the camera frame (x right, y down, z forward); without it the largest level-looking plane says")
      ->expected(3)
      ->allow_extra_args(false)  // the pictures may follow
      ->type_name("X Y Z");
  perceive
      ->add_option("--params", a.params, "Parameters of the module; of the surfaces, but the camera's noise and range")
      ->type_name("PARAMS.toml");
  const std::string folder = "; a folder when there are several pictures";
  perceive->add_option("--labels", a.labels, "Each pixel's plane, 0 = none" + folder)->type_name("OUT.png");
  perceive->add_option("--json", a.json, "The planes" + folder)->type_name("OUT.json");
  perceive->add_option("--picture", a.picture, "Planes, polygons and nosings over the depth" + folder)
      ->type_name("OUT.png");
  perceive->add_option("--html", a.html, "One page to look at it in three dimensions" + folder)->type_name("OUT.html");
  keep_within(*perceive->add_option("--repeat", a.repeat, "Extract so often, for the median and the longest time")
                   ->transform(CLI::Validator(decimal, ""))
                   ->capture_default_str(),
              1, kMaxRepeat);
  return perceive;
}

int run_perceive(const PerceiveArguments& a, std::ostream& out, std::ostream& err, const std::atomic<int>* interrupt) {
  if (const std::string sentence = complaint(a); !sentence.empty()) {
    err << "polygmap: " << sentence << "\n";
    return kExitUsage;
  }
  const bool several = a.depth.size() > 1;
  int code = kExitPass;
  const auto complain = [&](const std::exception& error) {
    err << "polygmap: " << error.what() << "\n";
    code = kExitUsage;
  };
  config::CameraProfile camera;
  Tuning tuning;
  try {
    for (const std::string& path : a.depth) {
      for (const std::string& file : outputs_of(a, path)) remove_output(file);  // a former run's is none of this one
    }
    tuning = tuning_of(a);
    camera = config::read_camera(a.camera);
    if (several) make_folders({a.labels, a.json, a.picture, a.html});
  } catch (const std::exception& error) {
    complain(error);
    return code;
  }
  std::size_t done = 0;
  for (const std::string& path : a.depth) {
    try {
      throw_if_interrupted(interrupt);
      out << one_picture(a, camera, tuning, path, several, err, interrupt) << std::flush;
      ++done;
    } catch (const Interrupted& by) {
      err << "polygmap: interrupted after " << done << " of " << a.depth.size()
          << " pictures: the others have no files.\n";
      return kExitSignal + by.signal;
    } catch (const std::exception& error) {
      complain(error);
    }
  }
  const int said = written(out, err);
  return said == kExitPass ? code : said;
}

}  // namespace polygmap::sim
