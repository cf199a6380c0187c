// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/world/kinds/kinds.hpp"

namespace polygmap::sim {
namespace {

struct Call {
  int code = -1;
  std::string out, err;
  std::optional<ClimbOptions> options;  // what the runner got, if it was called
};

std::string temporary(const std::string& name) { return testing::TempDir() + "polygmap_cli_test_" + name; }

std::vector<std::string> words(const std::string& line) {
  std::istringstream in(line);
  return {std::istream_iterator<std::string>(in), {}};
}

// Runs the command with a runner that records its options and says pass or fail.
Call call(std::vector<std::string> arguments, bool pass = true) {
  Call c;
  std::ostringstream out, err;
  if (std::find(arguments.begin(), arguments.end(), "--out") == arguments.end() && !arguments.empty()) {
    arguments.insert(arguments.end(), {"--out", temporary("default")});
  }
  const auto run = [&c, pass](const ClimbOptions& options, const ClimbProgressFunction& progress) {
    c.options = options;
    progress({1.0, 2, "swing", "perception", 812.0});
    progress({2.0, 2, "swing", "perception", 812.0});
    ClimbSummary s;
    s.pass = pass;
    s.reason = "Because.";
    return s;
  };
  c.code = polygmap_main(arguments, run, out, err, false);
  c.out = out.str();
  c.err = err.str();
  return c;
}

// Refused: exit 2, one sentence on one line that names the culprit, and no climb.
void expect_refused(const std::vector<std::string>& arguments, const std::string& culprit) {
  const Call c = call(arguments);
  EXPECT_EQ(c.code, kExitUsage) << culprit;
  EXPECT_FALSE(c.options) << culprit;
  EXPECT_NE(c.err.find(culprit), std::string::npos) << c.err;
  EXPECT_EQ(std::count(c.err.begin(), c.err.end(), '\n'), 1) << c.err;
  ASSERT_GE(c.err.size(), 2U);
  EXPECT_EQ(c.err.substr(c.err.size() - 2), ".\n") << c.err;
  EXPECT_EQ(c.out, "");
}

TEST(PolygmapCommand, Version_IsTheProjects) {
  const Call version = call({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_EQ(version.out, "polygmap " POLYGMAP_PROGRAM_VERSION "\n");
}

TEST(ClimbCommand, Contacts_InferredUnlessSensed) {
  EXPECT_FALSE(call({"climb"}).options->foot_sensors);
  EXPECT_FALSE(call({"climb", "--contacts", "inferred"}).options->foot_sensors);
  EXPECT_TRUE(call({"climb", "--contacts", "sensed"}).options->foot_sensors);
  expect_refused({"climb", "--contacts", "guessed"}, "--contacts");
}

TEST(ClimbCommand, AutostartOff_TakesAnOperator) {
  const std::string path = temporary("autostart.toml");
  std::ofstream(path) << "[supervisor]\nautostart = false\n";
  expect_refused({"climb", "--params", path}, "supervisor.autostart");
  EXPECT_EQ(call({"climb", "--params", path, "--ask", "arm@1"}).code, 0);
  EXPECT_EQ(call({"climb", "--params", path, "--kind", "up"}).code, 0) << "who sends it to the goal arms it";
  const std::string world = temporary("autostart_world.toml");
  std::ofstream(world) << "[start]\nx = 0\ny = 0\nyaw_deg = 0\nsurface = \"floor\"\n";
  expect_refused({"climb", "--params", path, "--world", world}, "supervisor.autostart");
  std::filesystem::remove(world);
  std::filesystem::remove(path);
}

TEST(ClimbCommand, CameraErrors_OnByDefault_EachCanBeTurnedOff) {
  const Call usual = call({"climb"});
  ASSERT_TRUE(usual.options) << usual.err;
  EXPECT_EQ(usual.options->scan_ms, 16.0);
  EXPECT_EQ(usual.options->reality.sensors.camera_mount_rad, kPi / 180.0);
  EXPECT_EQ(usual.options->reality.sensors.depth_scale, 0.003);
  EXPECT_TRUE(usual.options->estimate_mount);
  const Call none =
      call({"climb", "--scan-ms", "0", "--mount-error", "0", "--scale-error", "0", "--no-mount-estimate"});
  ASSERT_TRUE(none.options) << none.err;
  EXPECT_EQ(none.options->scan_ms, 0.0);
  EXPECT_EQ(none.options->reality.sensors.camera_mount_rad, 0.0);
  EXPECT_EQ(none.options->reality.sensors.camera_mount_m, 0.0);
  EXPECT_EQ(none.options->reality.sensors.depth_scale, 0.0);
  EXPECT_FALSE(none.options->estimate_mount);
  expect_refused({"climb", "--scan-ms", "40"}, "--scan-ms");
  expect_refused({"climb", "--mount-error", "-1"}, "--mount-error");
  expect_refused({"climb", "--scale-error", "nan"}, "--scale-error");
}

TEST(ClimbCommand, Camera_IsReadFromItsFile) {
  const std::string path = temporary("camera.toml");
  std::ofstream(path) << "width = 512\nheight = 424\nfx = 365\nfy = 365\ncx = 256\ncy = 212\ndepth_unit_m = 0.001\n"
                         "noise_quadratic_per_m = 0.002\n";
  const Call c = call({"climb", "--camera", path});
  ASSERT_TRUE(c.options && c.options->camera) << c.err;
  EXPECT_EQ(c.options->camera->intrinsics.width_px, 512);
  EXPECT_EQ(c.options->camera->noise.quadratic_per_m, 0.002);
  EXPECT_EQ(c.options->camera_file, path);
  expect_refused({"climb", "--camera", temporary("none.toml")}, "none.toml");
  expect_refused({"climb", "--camera", std::string(300, 'x') + ".toml"}, "Cannot read");
  for (const std::string size : {"644x480", "640x482", "1024x768", "63x64"}) {  // more than the module's memory, or odd
    const std::size_t x = size.find('x');
    std::ofstream(path) << "width = " << size.substr(0, x) << "\nheight = " << size.substr(x + 1)
                        << "\nfx = 365\nfy = 365\ncx = 256\ncy = 212\ndepth_unit_m = 0.001\n";
    expect_refused({"climb", "--camera", path}, "not " + size);
  }
}

TEST(ClimbCommand, NoOptions_RunsWithTheDefaults) {
  const Call c = call({"climb"});
  ASSERT_TRUE(c.options) << c.err;
  EXPECT_EQ(c.code, kExitPass);
  EXPECT_EQ(c.options->stairs.steps, 10);
  EXPECT_EQ(c.options->stairs.rise_m, 0.13);
  EXPECT_EQ(c.options->stairs.tread_m, 0.28);
  EXPECT_EQ(c.options->stairs.width_m, 1.2);
  EXPECT_EQ(c.options->stairs.nosing_m, 0.0);
  EXPECT_EQ(c.options->stairs.landing_m, 1.0);
  EXPECT_EQ(c.options->seed, 1U);
  EXPECT_EQ(c.options->noise, NoiseKind::kWhite);
  EXPECT_EQ(c.options->plant, PlantKind::kMujoco);
  EXPECT_EQ(c.options->render_missing_step, -1);
  EXPECT_FALSE(c.options->blank_depth);
  EXPECT_TRUE(c.options->self_filter);
  EXPECT_EQ(c.err, "");
}

TEST(ClimbCommand, EveryOption_ReachesTheRun) {
  const Call c =
      call(words("climb --steps 4 --rise 0.15 --tread 0.3 --width 0.8 --nosing 0.02 --landing 1.5 --jitter 0.01 "
                 "--gait ss --seed 42 --noise correlated --render-shift 0.03 -0.01 0.02 "
                 "--render-missing-step 3 --blank-depth --no-self-filter --push 5,x,10 --push 7.5,y,-8 "
                 "--mass-scale 1.2 --torso-offset-x -0.015 --friction 0.4 --out " +
                 temporary("every/deep")));
  ASSERT_TRUE(c.options) << c.err;
  EXPECT_EQ(c.options->stairs.steps, 4);
  EXPECT_EQ(c.options->stairs.rise_m, 0.15);
  EXPECT_EQ(c.options->stairs.tread_m, 0.3);
  EXPECT_EQ(c.options->stairs.width_m, 0.8);
  EXPECT_EQ(c.options->stairs.nosing_m, 0.02);
  EXPECT_EQ(c.options->stairs.landing_m, 1.5);
  EXPECT_EQ(c.options->stairs.jitter_m, 0.01);
  EXPECT_EQ(c.options->gait, GaitPattern::kSingleStep);
  ASSERT_EQ(c.options->pushes.size(), 2U);
  EXPECT_EQ(c.options->pushes[0].axis, 0);
  EXPECT_EQ(c.options->pushes[1].at_s, 7.5);
  EXPECT_EQ(c.options->pushes[1].axis, 1);
  EXPECT_EQ(c.options->pushes[1].impulse_ns, -8.0);
  EXPECT_EQ(c.options->reality.plant.torso_mass_scale, 1.2);
  EXPECT_EQ(c.options->reality.plant.torso_offset_x_m, -0.015);
  EXPECT_EQ(c.options->reality.plant.friction, 0.4);
  EXPECT_EQ(c.options->seed, 42U);
  EXPECT_EQ(c.options->noise, NoiseKind::kCorrelated);
  EXPECT_EQ(c.options->out_dir, temporary("every/deep"));
  EXPECT_EQ(c.options->render_dx_m, 0.03);
  EXPECT_EQ(c.options->render_dy_m, -0.01);
  EXPECT_EQ(c.options->render_dz_m, 0.02);
  EXPECT_EQ(c.options->render_missing_step, 2);  // 0-based inside
  EXPECT_TRUE(c.options->blank_depth);
  EXPECT_FALSE(c.options->self_filter);
  EXPECT_TRUE(std::filesystem::is_directory(temporary("every/deep")));
}

TEST(ClimbCommand, BadLength_IsRefusedWithOneSentence) {
  for (const char* option : {"--rise", "--tread", "--width", "--landing"}) {
    for (const char* value : {"nan", "inf", "-inf", "0", "-0.1", "0.0099", "2.01", "1e9", "1e300", "abc", ""}) {
      expect_refused({"climb", option, value}, option);
    }
  }
  // 0.276: below the tread, but not below the shortest that the jitter may draw.
  for (const char* value : {"nan", "inf", "-0.01", "2.5", "0.276", "x", ""}) {
    expect_refused({"climb", "--nosing", value}, "--nosing");
  }
  for (const char* value : {"nan", "-0.001", "0.066", "x", ""}) {
    expect_refused({"climb", "--jitter", value}, "--jitter");
  }
}

TEST(ClimbCommand, BodyOutsideItsRangeOrOnTheKinematicPlant_IsRefused) {
  for (const char* value : {"nan", "inf", "0.49", "2.1", "x", ""}) {
    expect_refused({"climb", "--mass-scale", value}, "--mass-scale");
  }
  for (const char* value : {"nan", "-0.11", "0.11", "x", ""}) {
    expect_refused({"climb", "--torso-offset-x", value}, "--torso-offset-x");
  }
  for (const char* value : {"nan", "0", "-0.4", "2.1", "x", ""}) {
    expect_refused({"climb", "--friction", value}, "--friction");
  }
  for (const char* option : {"--mass-scale", "--torso-offset-x", "--friction"}) {
    const char* value = option == std::string("--torso-offset-x") ? "0.03" : "0.9";
    expect_refused({"climb", "--plant", "kinematic", option, value}, option);
    EXPECT_TRUE(call({"climb", option, value}).options) << option;
  }
}

// What is enforced stands in the help, and the sentence about another value says it once more.
TEST(Ranges, EveryOne_StandsInTheHelpAndInTheSentence) {
  const std::string climb = call({"climb", "--help"}).out;
  const struct {
    const char *option, *help, *value, *sentence;
  } kRanges[] = {
      {"--steps", "INT in [1, 200]=10", "201", "must be from 1 to 200, not 201"},
      {"--rise", "FLOAT in [0.01, 2]=0.13", "3", "must be from 0.01 to 2 m, not 3"},
      {"--tread", "FLOAT in [0.01, 2]=0.28", "nan", "must be from 0.01 to 2 m, not nan"},
      {"--width", "FLOAT in [0.01, 2]=1.2", "0", "must be from 0.01 to 2 m, not 0"},
      {"--nosing", "FLOAT in [0, 2]=0", "-1", "must be from 0 to 2 m, not -1"},
      {"--landing", "FLOAT in [0.01, 2]=1", "inf", "must be from 0.01 to 2 m, not inf"},
      {"--balusters", "FLOAT in [0.05, 2]", "nan", "must be from 0.05 to 2 m, not nan"},
      {"--baluster-inset", "FLOAT in [-1, 1]=0.02", "-2", "must be from -1 to 1 m, not -2"},
      {"--baluster-size", "FLOAT in [0.01, 0.3]=0.04", "1", "must be from 0.01 to 0.3 m, not 1"},
      {"--baluster-side", "both|left|right", "top", "must be both, left or right, not \"top\""},
      {"--plant", "mujoco|kinematic=mujoco", "rubber", "must be mujoco or kinematic, not \"rubber\""},
      {"--gait", "ds|ss=ds", "trot", "must be ds or ss, not \"trot\""},
      {"--noise", "white|correlated=white", "pink", "must be white or correlated, not \"pink\""},
      {"--contacts", "inferred|sensed=inferred", "none", "must be inferred or sensed, not \"none\""},
      {"--mass-scale", "FLOAT in [0.5, 2]=1", "0.4", "must be from 0.5 to 2, not 0.4"},
      {"--torso-offset-x", "FLOAT in [-0.1, 0.1]=0", "0.2", "must be from -0.1 to 0.1 m, not 0.2"},
      {"--friction", "FLOAT in [0.05, 2]=0.8", "0", "must be from 0.05 to 2, not 0"},
      {"--scan-ms", "FLOAT in [0, 32]=16", "33", "must be from 0 to 32 ms, not 33"},
      {"--mount-error", "FLOAT in [0, 5]=1", "6", "must be from 0 to 5 degrees, not 6"},
      {"--scale-error", "FLOAT in [0, 0.05]=0.003", "1", "must be from 0 to 0.05, not 1"},
      {"--seed", "UINT in [0, 2^64 - 1]=1", "-1", "must be a whole number from 0 to 2^64 - 1, not -1"},
  };
  for (const auto& range : kRanges) {
    EXPECT_NE(climb.find(std::string("  ") + range.option + " " + range.help), std::string::npos) << range.option;
    expect_refused({"climb", range.option, range.value},
                   std::string("polygmap: ") + range.option + " " + range.sentence + "; see polygmap climb --help.");
  }
  for (const char* part : {"from 1.024 to 1000 s;", "from -100 to 100 N s", "m, each from -2 to 2", "--steps",
                           "from 0 to half of rise and tread", "each from -100 to 100, sizes from 0.005"}) {
    EXPECT_NE(climb.find(part), std::string::npos) << part;
  }
  expect_refused({"climb", "--obstacle", "0,0,0,1,1,0.001"}, "sizes from 0.005, not \"0,0,0,1,1,0.001\"");
  const std::string estimate = call({"estimate", "--help"}).out, perceive = call({"perceive", "--help"}).out;
  EXPECT_NE(estimate.find("--lio-tau FLOAT in [0, 1000]"), std::string::npos) << estimate;
  EXPECT_NE(estimate.find("each from -10 to 10, and degrees"), std::string::npos) << estimate;
  EXPECT_NE(perceive.find("--repeat INT in [1, 100000]=1"), std::string::npos) << perceive;
}

TEST(Ranges, BothEnds_AreTaken) {
  for (const auto& [option, least, most] : {std::tuple{"--steps", "1", "200"},
                                            {"--mass-scale", "0.5", "2"},
                                            {"--torso-offset-x", "-0.1", "0.1"},
                                            {"--friction", "0.05", "2"},
                                            {"--scan-ms", "0", "32"},
                                            {"--mount-error", "0", "5"},
                                            {"--scale-error", "0", "0.05"},
                                            {"--balusters", "0.05", "2"}}) {
    EXPECT_TRUE(call({"climb", option, least}).options) << option;
    EXPECT_TRUE(call({"climb", option, most}).options) << option;
  }
}

TEST(ClimbCommand, WordsWithLineBreaks_StayOnOneLine) {
  expect_refused({"climb", "--rise", "1\n2"}, "\"1?2\" is no number that --rise can take");
  expect_refused({"climb", "--gait", "d\ns"}, "not \"d?s\"");
}

TEST(ClimbCommand, UnclimbableStairs_Run) {
  EXPECT_TRUE(call({"climb", "--rise", "0.5", "--tread", "0.1"}).options);
  EXPECT_TRUE(call({"climb", "--rise", "2", "--tread", "2", "--width", "2", "--landing", "2"}).options);
}

TEST(ClimbCommand, LongStairs_GetTheTimeTheyNeed) {
  EXPECT_EQ(call({"climb"}).options->time_limit_s, ClimbOptions{}.time_limit_s);
  EXPECT_GE(call({"climb", "--steps", "200"}).options->time_limit_s, 200 * 3.7 + 30.0);
}

TEST(ClimbCommand, BadCount_IsRefused) {
  for (const char* value : {"0", "-3", "201", "1.5", "99999999999999999999", "many"}) {
    expect_refused({"climb", "--steps", value}, "--steps");
  }
  for (const char* value : {"-1", "1.5", "99999999999999999999999", "x"}) {
    expect_refused({"climb", "--seed", value}, "--seed");
  }
  expect_refused({"climb", "--steps", "4", "--render-missing-step", "5"}, "--render-missing-step");
  expect_refused({"climb", "--render-missing-step", "-1"}, "--render-missing-step");
  expect_refused({"climb", "--render-missing-step", "0"}, "--render-missing-step");
}

TEST(ClimbCommand, BadWord_IsRefused) {
  expect_refused({"climb", "--gait", "trot"}, "--gait");
  expect_refused({"climb", "--plant", "rubber"}, "--plant");
  expect_refused({"climb", "--plant", "kinematic", "--push", "5,x,10"}, "--push");
  for (const std::string push : {"x", "5,x", "5,z,10", "5,x,10,", "1.0,x,10", "nan,x,10", "5,y,1000", "5,y,nan"}) {
    expect_refused({"climb", "--push", push}, "--push");
  }
  expect_refused({"climb", "--noise", "pink"}, "--noise");
  expect_refused({"climb", "--render-shift", "0.01", "nan", "0"}, "--render-shift");
  expect_refused({"climb", "--render-shift", "0.01", "0.02"}, "--render-shift needs 3 values;");
  expect_refused({"climb", "--bogus", "3"}, "There is no option --bogus; see polygmap climb --help.");
  expect_refused({"climb", "--steps", "many"}, "\"many\" is no whole number that --steps can take");
  expect_refused({"climb", "--rise", "1..2"}, "\"1..2\" is no number that --rise can take");
  expect_refused({"climb", "climb"}, "\"climb\" is a word too many");
  expect_refused({"climb", "--steps", "3", "--steps", "4"}, "--steps is given more than once");
  expect_refused({"climb", "--render-shift", "", "", ""}, "--render-shift");
  EXPECT_EQ(call({"climb", "--render-shift", "-.01", "0", ".02"}).options->render_dx_m, -0.01);
  expect_refused({"--bogus"}, "--bogus");
  expect_refused({"dance"}, "\"dance\" is no command; see polygmap --help.");
  expect_refused({}, "subcommand");
}

TEST(ClimbCommand, BalustersOfNoUse_AreRefused) {
  for (const auto& [option, value] :
       {std::pair{"--baluster-side", "left"}, {"--baluster-inset", "0.02"}, {"--baluster-size", "0.04"}}) {
    expect_refused({"climb", option, value}, std::string(option) + " is of no use without --balusters.");
    EXPECT_TRUE(call({"climb", option, value, "--balusters", "0.2"}).options) << option;
  }
}

TEST(ClimbCommand, UnwritableOut_IsRefused) {
  const std::string file = temporary("a_file");
  std::ofstream(file) << "x";
  expect_refused({"climb", "--out", file}, file + "\" given by --out: Not a directory.");
  expect_refused({"climb", "--out", file + "/inside"}, file);
  expect_refused({"climb", "--out", "/proc/polygmap"}, "/proc/polygmap");
  expect_refused({"climb", "--out", "/proc"}, "/proc");
  expect_refused({"climb", "--out", ""}, "--out");
}

TEST(ClimbCommand, BadArguments_LeaveNoDirectory) {
  const std::string directory = temporary("never_made");
  std::filesystem::remove_all(directory);
  expect_refused({"climb", "--rise", "nan", "--out", directory}, "--rise");
  EXPECT_FALSE(std::filesystem::exists(directory));
}

TEST(ClimbCommand, Verdict_IsOneLineAndTheExitCode) {
  const Call pass = call({"climb"});
  EXPECT_EQ(pass.code, 0);
  EXPECT_NE(pass.out.find("\nPASS: Because.\n"), std::string::npos) << pass.out;
  const Call fail = call({"climb"}, false);
  EXPECT_EQ(fail.code, 1);
  EXPECT_NE(fail.out.find("\nFAIL: Because.\n"), std::string::npos) << fail.out;
}

TEST(ClimbCommand, Progress_IsALineNowAndThenInALog) {
  const Call c = call({"climb", "--steps", "7"});
  EXPECT_NE(c.out.find("step 2 of 7"), std::string::npos) << c.out;
  EXPECT_NE(c.out.find("perception 812 us"), std::string::npos) << c.out;
  EXPECT_EQ(std::count(c.out.begin(), c.out.end(), '\n'), 2)
      << "one progress line (the second is too soon), one verdict";
}

TEST(ClimbCommand, RunThatCannotWrite_StillTellsTheVerdictAndExits2) {
  std::ostringstream out, err;
  const int code = polygmap_main(
      {"climb", "--out", temporary("throws")},
      [](const ClimbOptions&, const ClimbProgressFunction&) -> ClimbSummary {
        ClimbSummary climbed;
        climbed.pass = true;
        climbed.reason = "Because.";
        throw ClimbNotWritten("Cannot write it.", climbed);
      },
      out, err, false);
  EXPECT_EQ(code, kExitUsage);
  EXPECT_EQ(out.str(), "PASS: Because.\n");
  EXPECT_EQ(err.str(), "polygmap: Cannot write it.\n");
}

TEST(ClimbCommand, StandardOutputFull_SaysSoAndExits2) {
  std::ofstream out("/dev/full");
  std::ostringstream err;
  const auto run = [](const ClimbOptions&, const ClimbProgressFunction&) { return ClimbSummary{}; };
  EXPECT_EQ(polygmap_main({"climb", "--out", temporary("full")}, run, out, err, false), kExitUsage);
  EXPECT_EQ(err.str(), "polygmap: Cannot write the verdict to the standard output.\n");
}

TEST(Cli, StandardOutputFull_SaysSoAndExits2) {
  for (const std::string words :
       {"--help", "climb --help", "params list", "params docs", "can dbc --bus " POLYGMAP_BUSES "/damiao.toml"}) {
    std::ofstream out("/dev/full");
    std::ostringstream err;
    std::istringstream in(words);
    EXPECT_EQ(polygmap_main({std::istream_iterator<std::string>(in), {}}, {}, out, err, false), kExitUsage) << words;
    EXPECT_EQ(err.str(), "polygmap: Cannot write to the standard output.\n") << words;
  }
}

TEST(ClimbCommand, CanLogOverAnotherFileOfTheClimb_IsRefusedAndTheFileIsWhole) {
  const std::string bus = temporary("bus.toml");
  std::filesystem::copy_file(POLYGMAP_BUSES "/damiao.toml", bus, std::filesystem::copy_options::overwrite_existing);
  const auto bytes = std::filesystem::file_size(bus);
  expect_refused({"climb", "--bus", bus, "--can-log", bus}, "\"" + bus + "\" would be overwritten by --can-log.");
  EXPECT_EQ(std::filesystem::file_size(bus), bytes);
  expect_refused({"climb", "--bus", bus, "--out", temporary("log"), "--can-log", temporary("log/./summary.json")},
                 "would be overwritten by --can-log.");
  EXPECT_TRUE(call({"climb", "--bus", bus, "--can-log", temporary("can.log")}).options);
}

TEST(ClimbCommand, Help_ExplainsExitCodesAndOptions) {
  const Call app = call({"--help"});
  EXPECT_EQ(app.code, 0);
  EXPECT_NE(app.out.find("Exit codes"), std::string::npos);
  const Call climb = call({"climb", "--help"});
  EXPECT_EQ(climb.code, 0);
  for (const char* part : {"--rise", "0.13", "causality", "--render-shift"}) {
    EXPECT_NE(climb.out.find(part), std::string::npos) << part << "\n" << climb.out;
  }
}

TEST(Cli, Record_IsBesideTheOtherFilesAndHandedOn) {
  const std::string folder = temporary("record/inner");
  const auto recorded = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"climb", "--out", folder};
    words.insert(words.end(), more.begin(), more.end());
    const Call c = call(words);
    EXPECT_TRUE(c.options);
    return std::pair{c.options->recording, c.options->record_pictures};
  };
  EXPECT_EQ(recorded({}), std::pair(folder + "/run.mcap", false));
  EXPECT_TRUE(std::filesystem::is_directory(folder));
  EXPECT_EQ(recorded({"--record", "no-pictures"}), std::pair(folder + "/run.mcap", false));
  EXPECT_EQ(recorded({"--record", "all"}), std::pair(folder + "/run.mcap", true));
  std::ofstream(folder + "/run.mcap") << "of a former run";
  EXPECT_EQ(recorded({"--record", "none"}), std::pair(std::string(), false));
  EXPECT_FALSE(std::filesystem::exists(folder + "/run.mcap")) << "it is none of this run's";
  expect_refused({"climb", "--record", "some"}, "--record");
}

TEST(Cli, ReplayOfNoRecording_IsOneSentence) {
  std::ostringstream out, err;
  EXPECT_EQ(polygmap_main({"replay", "/there/is/none"}, {}, out, err, false), kExitUsage);
  EXPECT_EQ(err.str().find("polygmap: \"/there/is/none\" is no recording: there is no such file.\n"), 0U) << err.str();
  const std::string said = err.str();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1);
  EXPECT_TRUE(out.str().empty());
}

// What the runner got is what the file says, which --world reads: to a tenth of a millimetre there is no other world.
TEST(ClimbCommand, Kind_IsDrawnByTheSeedAndWrittenForWorldToRead) {
  const std::string out = temporary("kind");
  for (const char* kind : {"up", "spiral-down", "stones", "trap"}) {
    const Call drawn = call({"climb", "--kind", kind, "--seed", "5", "--out", out});
    ASSERT_TRUE(drawn.options && drawn.options->world) << drawn.err;
    EXPECT_EQ(drawn.options->world_kind, kind);
    EXPECT_EQ(drawn.options->world_drawn.find(std::string(kind) + ", seed 5: "), 0U);
    const Call read = call({"climb", "--world", out + "/world.toml", "--seed", "5", "--out", out});
    ASSERT_TRUE(read.options && read.options->world) << read.err;
    const WorldFile &a = *drawn.options->world, &b = *read.options->world;
    EXPECT_EQ(a.start.x_m, b.start.x_m);
    EXPECT_EQ(a.start.yaw_rad, b.start.yaw_rad);
    EXPECT_EQ(a.start_height_m, b.start_height_m);
    ASSERT_EQ(a.world.solids.size(), b.world.solids.size());
    for (std::size_t i = 0; i < a.world.solids.size(); ++i) {
      EXPECT_EQ(a.world.solids[i].max_m, b.world.solids[i].max_m);
      EXPECT_EQ(a.world.solids[i].true_T_solid.p_m, b.world.solids[i].true_T_solid.p_m);
      EXPECT_EQ(a.world.solids[i].true_T_solid.R, b.world.solids[i].true_T_solid.R);
      EXPECT_EQ(a.world.steps[i].name, b.world.steps[i].name);
    }
  }
  EXPECT_EQ(read_world(out + "/world.toml").world.is_staircase, false);
}

// Seen from the start, which looks along y here.
TEST(ClimbCommand, World_WhoseGoalIsTooFarToBeSentTo_IsRefused) {
  const std::string path = temporary("far_goal.toml");
  const auto with_goal = [&path](const std::string& x, const std::string& y) {
    std::ofstream(path) << "[start]\nx = 10\ny = 0\nyaw_deg = 90\nsurface = \"floor\"\n[goal]\nx = " << x
                        << "\ny = " << y << "\nsurface = \"floor\"\n";
    return std::vector<std::string>{"climb", "--world", path};
  };
  EXPECT_EQ(call(with_goal("-39.5", "49.5")).code, 0);
  const std::string bound = " m to the left of where the robot starts, and go_to takes 50 m at most, each way.";
  expect_refused(with_goal("9", "60.5"), "far_goal.toml\": its goal is 60.5 m ahead and 1" + bound);
  expect_refused(with_goal("70", "-3"), "far_goal.toml\": its goal is -3 m ahead and -60" + bound);
  std::filesystem::remove(path);
}

TEST(ClimbCommand, Kind_ThatCannotBe_IsRefused) {
  expect_refused({"climb", "--kind", "escalator"}, "--kind must be up, up-high, ");
  expect_refused({"climb", "--kind", "up", "--world", "w.toml"}, "--world");
  expect_refused({"climb", "--kind", "up", "--steps", "4"}, "--steps is of a staircase, and --kind has none");
  expect_refused({"climb", "--back"}, "--back needs a world with a goal");
  expect_refused({"climb", "--kind", "up", "--back", "--ask", "arm@1"}, "--back sends the robot itself");
  expect_refused({"climb", "--kind", "up", "--plant", "kinematic"}, "--kind needs --plant mujoco");
}

TEST(ClimbCommand, Help_HasASentenceForEachKind) {
  const Call help = call({"climb", "--help"});
  for (const WorldKind& kind : world_kinds()) {
    EXPECT_NE(help.out.find("  " + std::string(kind.name) + " "), std::string::npos);
    EXPECT_NE(help.out.find(kind.what), std::string::npos);
  }
}

}  // namespace
}  // namespace polygmap::sim
