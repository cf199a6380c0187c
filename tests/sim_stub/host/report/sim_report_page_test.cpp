// SPDX-License-Identifier: Apache-2.0
// The page about a robot's own recording, which has pictures, and neither truth nor verdict.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "firmware/recording/recorder.hpp"
#include "sim_stub/host/report/report_page.hpp"
#include "tests/support/fake_robot.hpp"

namespace polygmap::sim {
namespace {

TEST(WriteReport, RecordingOfARobot_HasItsPicturesAndSaysWhatIsMissing) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("polygmap_robot_report_" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  const std::string path = folder / "run.mcap";
  test::FakeRobot robot(0.062);
  const auto recorder = std::make_unique<recording::Recorder>(robot.ports(), &robot.camera);
  const auto module = std::make_unique<Pipeline>(recorder->ports(), Params{});
  recorder->begin(path, Params{}, 1);
  recorder->watch(*module);
  recording::RecordedTasks<Pipeline> tasks(*module, recorder.get());
  OneLaneExecutive<recording::RecordedTasks<Pipeline>> executive(tasks, robot.clock, module->lane_health(0));
  executive.start(robot.clock.now_ns() + kCycle_ns);
  constexpr int kTicks = 1000;
  for (int i = 0; i < kTicks; ++i) {
    robot.advance();
    executive.tick(robot.clock.now_ns());
    recorder->flush();
  }
  ASSERT_EQ(recorder->finish(), "");

  const ReportedFiles files = write_report({path}, folder.string());
  EXPECT_EQ(files.unreadable, "");
  EXPECT_EQ(files.unsound, "");
  std::ifstream file(folder / "report.html");
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  const std::size_t data = page.find("polygmap-report");
  ASSERT_NE(data, std::string::npos);
  EXPECT_NE(page.find(R"("png":)", data), std::string::npos);
  EXPECT_NE(page.find("The file has no truth, as a robot's own has none", data), std::string::npos);
  EXPECT_EQ(page.find(R"("summary":)", data), std::string::npos);
  // One bit of its middle is not what was written.
  std::fstream bytes(path, std::ios::in | std::ios::out | std::ios::binary);
  const auto middle = static_cast<std::streamoff>(std::filesystem::file_size(path) / 2);
  bytes.seekg(middle);
  const int byte = bytes.get();
  bytes.seekp(middle);
  bytes.put(static_cast<char>(byte ^ 4));
  bytes.close();
  const ReportedFiles damaged = write_report({path}, folder.string());
  EXPECT_EQ(damaged.unreadable, "");
  EXPECT_NE(damaged.unsound.find("(CRC)"), std::string::npos) << damaged.unsound;
  std::ifstream again(folder / "report.html");
  const std::string damaged_page((std::istreambuf_iterator<char>(again)), {});
  EXPECT_NE(damaged_page.find(R"("damage":)", damaged_page.find("polygmap-report")), std::string::npos);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace polygmap::sim
