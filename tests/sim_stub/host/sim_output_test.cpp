// SPDX-License-Identifier: Apache-2.0
// What a run leaves on the disk, and what hostile input may cost: nothing half written, nothing of a former run, no
// memory that a file's header asks for.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "firmware/config/camera_file.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/climb/climb.hpp"
#include "sim_stub/host/estimate/csv_table.hpp"
#include "sim_stub/host/output_file.hpp"
#include "sim_stub/host/perceive/perceive.hpp"

namespace polygmap::sim {
namespace {

namespace fs = std::filesystem;

std::string fresh_folder(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("polygmap_output_test_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder.string();
}
std::string text_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}
// What is told of what is thrown; empty when nothing is.
template <typename Action>
std::string complaint_of(const Action& action) {
  try {
    action();
  } catch (const config::FileError& error) {
    return error.what();
  }
  return "";
}

TEST(OutputFile, Written_IsWholeAndLeavesNothingBeside) {
  const std::string folder = fresh_folder("whole"), path = folder + "/a.json";
  write_output(path, "one, which is longer");
  write_output(path, "two");
  EXPECT_EQ(text_of(path), "two");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), {}), 1);
}

TEST(OutputFile, FullDiskOrNoFolder_SaysSoAndKeepsTheOldFile) {
  EXPECT_NE(complaint_of([] { write_output("/dev/full", "x"); }).find("Cannot write \"/dev/full\""), std::string::npos);
  EXPECT_NE(complaint_of([] { write_output(fresh_folder("none") + "/no/a.json", "x"); }).find("a.json"),
            std::string::npos);
}

ClimbSummary no_climb(const ClimbOptions&, const ClimbProgressFunction&) { throw std::runtime_error("No memory."); }

TEST(ClimbOutput, RunThatBreaks_LeavesNoFormerPass) {
  const std::string folder = fresh_folder("former");
  write_output(folder + "/summary.json", "{\"verdict\": \"pass\"}");
  write_output(folder + "/climb.svg", "<svg/>");
  std::ostringstream out, err;
  EXPECT_EQ(polygmap_main({"climb", "--out", folder}, no_climb, out, err, false), kExitUsage);
  EXPECT_TRUE(fs::is_empty(folder));
}

TEST(ClimbOutput, Interrupted_FilesAreThereAndSayIt) {
  const std::string folder = fresh_folder("interrupted");
  const std::atomic<int> signal{SIGTERM};
  ClimbOptions options;
  options.plant = PlantKind::kKinematic;
  options.out_dir = folder;
  options.interrupt = &signal;
  std::ostringstream out, err;
  const auto run = [&](const ClimbOptions&, const ClimbProgressFunction& progress) {
    return run_climb(options, progress);
  };
  EXPECT_EQ(polygmap_main({"climb", "--out", folder}, run, out, err, false), kExitSignal + SIGTERM);
  EXPECT_NE(out.str().find("INTERRUPTED: "), std::string::npos) << out.str();
  EXPECT_NE(text_of(folder + "/summary.json").find("\"verdict\": \"interrupted\""), std::string::npos);
  EXPECT_TRUE(fs::exists(folder + "/climb.svg"));
}

TEST(ClimbOutput, FileNameThatIsNoUtf8_IsNamedAllTheSame) {
  ClimbSummary summary;
  summary.options.camera_file = "camera_\xFF.toml";
  summary.options.camera.emplace();
  EXPECT_NE(summary_text(summary).find("camera_"), std::string::npos);
}

TEST(ClimbNumbers, LeadingZeros_AreDecimal) {
  const auto seed_of = [](const std::string& word) {
    std::optional<std::uint64_t> seed;
    std::ostringstream out, err;
    const auto run = [&](const ClimbOptions& options, const ClimbProgressFunction&) {
      seed = options.seed;
      return ClimbSummary{};
    };
    (void)polygmap_main({"climb", "--seed", word, "--out", fresh_folder("seed")}, run, out, err, false);
    return seed;
  };
  EXPECT_EQ(seed_of("010"), 10U);
  EXPECT_EQ(seed_of("000"), 0U);
  EXPECT_EQ(seed_of("08"), 8U);
  EXPECT_FALSE(seed_of("0x10"));
}

TEST(CameraFile, WholeNumberThatNoDoubleHolds_IsRefusedWithItsLine) {
  const std::string path = fresh_folder("camera") + "/camera.toml";
  for (const std::string width : {"9007199254740993", "99999999999999999999"}) {
    std::ofstream(path) << "height = 480\nwidth = " << width
                        << "\nfx = 365\nfy = 365\ncx = 256\ncy = 212\ndepth_unit_m = 0.001\n";
    const std::string complaint = complaint_of([&] { (void)config::read_camera(path); });
    EXPECT_NE(complaint.find("line 2"), std::string::npos) << complaint;
  }
}

TEST(DepthPicture, FolderOrFileTooLarge_IsRefusedBeforeItIsRead) {
  const std::string folder = fresh_folder("picture"), path = folder + "/huge.png";
  EXPECT_NE(complaint_of([&] { (void)read_depth(folder); }).find("is a folder"), std::string::npos);
  std::ofstream(path) << "x";
  fs::resize_file(path, std::uintmax_t{8} << 30U);  // a hole on the disk
  EXPECT_NE(complaint_of([&] { (void)read_depth(path); }).find("bytes, more than"), std::string::npos);
}

TEST(CsvTable, MillionsOfColumnsOrGigabytes_AreRefused) {
  const std::string path = fresh_folder("csv") + "/log.csv";
  std::ofstream(path) << "a" << std::string(2'000'000, ',') << "\n1\n";
  EXPECT_NE(complaint_of([&] { CsvTable table(path); }).find("more than 1000 columns"), std::string::npos);
  fs::resize_file(path, std::uintmax_t{2} << 30U);
  EXPECT_NE(complaint_of([&] { CsvTable table(path); }).find("MiB"), std::string::npos);
}

}  // namespace
}  // namespace polygmap::sim
