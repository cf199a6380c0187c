// SPDX-License-Identifier: Apache-2.0
// What a run leaves on the disk, and what hostile input may cost: nothing half written, nothing of a former run, no
// memory that a file's header asks for.
#include <gtest/gtest.h>
#include <lodepng.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdlib>
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
  std::ofstream(path) << "t_s" << std::string(2'000'000, ',') << "\n1\n";
  EXPECT_NE(complaint_of([&] { CsvTable table(path, "t_s"); }).find("more than 1000 columns"), std::string::npos);
  fs::resize_file(path, std::uintmax_t{2} << 30U);
  EXPECT_NE(complaint_of([&] { CsvTable table(path, "t_s"); }).find("MiB"), std::string::npos);
}

TEST(CsvTable, MillionsOfShortRows_AreRefused) {
  const std::string path = fresh_folder("rows") + "/log.csv";
  std::string text = "t_s\n";
  for (int i = 0; i < 600'001; ++i) text += "1\n";
  std::ofstream(path) << text;
  EXPECT_NE(complaint_of([&] { CsvTable table(path, "t_s"); }).find("more than 600000 rows"), std::string::npos);
  text.resize(text.size() - 2);
  std::ofstream(path) << text;
  EXPECT_EQ(complaint_of([&] { CsvTable table(path, "t_s"); }), "");
}

TEST(OutputFile, Removed_FileGoes_LinkAndDeviceStay_AndWhatTheLinkLeadsToIsEmptied) {
  const std::string folder = fresh_folder("removed"), file = folder + "/file", link = folder + "/link";
  std::ofstream(file) << "old";
  fs::create_symlink(file, link);
  remove_output(link);
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(text_of(file), "");
  EXPECT_TRUE(fs::exists(file));
  remove_output(file);
  EXPECT_FALSE(fs::exists(file));
  remove_output(file);
  remove_output("/dev/null");
  EXPECT_TRUE(fs::exists("/dev/null"));
}

// A picture's bytes: signature, and chunks with their checksums.
std::string png(std::uint32_t width, std::uint32_t height, const std::string& unpacked) {
  const auto number = [](std::uint32_t n) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(n >> static_cast<unsigned>(shift) & 0xFFU);
    return bytes;
  };
  const auto chunk = [&number](const std::string& type, const std::string& data) {
    const std::string body = type + data;
    const unsigned crc = lodepng_crc32(reinterpret_cast<const unsigned char*>(body.data()), body.size());
    return number(static_cast<std::uint32_t>(data.size())) + body + number(crc);
  };
  unsigned char* packed = nullptr;
  std::size_t size = 0;
  LodePNGCompressSettings settings;
  lodepng_compress_settings_init(&settings);
  EXPECT_EQ(lodepng_zlib_compress(&packed, &size, reinterpret_cast<const unsigned char*>(unpacked.data()),
                                  unpacked.size(), &settings),
            0U);
  const std::string stream(reinterpret_cast<const char*>(packed), size);
  std::free(packed);
  return std::string("\x89PNG\r\n\x1a\n") +
         chunk("IHDR", number(width) + number(height) + std::string("\x10\0\0\0\0", 5)) + chunk("IDAT", stream) +
         chunk("IEND", "");
}

TEST(DepthPicture, HeaderThatAsksForGigabytes_OrStreamThatUnpacksToThem_IsRefused) {
  const std::string path = fresh_folder("bomb") + "/bomb.png";
  std::ofstream(path, std::ios::binary) << png(0x7fffffff, 0x7fffffff, "x");
  EXPECT_NE(complaint_of([&] { (void)read_depth(path); }).find("bomb.png"), std::string::npos);
  std::ofstream(path, std::ios::binary) << png(40000, 40000, "x");
  EXPECT_NE(complaint_of([&] { (void)read_depth(path); }).find("is 40000x40000, more than"), std::string::npos);
  const std::string bomb(std::size_t{64} << 20U, '\0');
  std::ofstream(path, std::ios::binary) << png(32, 32, bomb);
  ASSERT_LT(fs::file_size(path), 1U << 20U);
  EXPECT_NE(complaint_of([&] { (void)read_depth(path); }).find("is damaged"), std::string::npos);
  std::ofstream(path, std::ios::binary) << png(32, 32, bomb.substr(0, 32 * 65));
  EXPECT_EQ(complaint_of([&] { (void)read_depth(path); }), "") << "the same with as many bytes as it says";
}

}  // namespace
}  // namespace polygmap::sim
