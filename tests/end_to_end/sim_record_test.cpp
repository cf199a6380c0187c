// SPDX-License-Identifier: Apache-2.0
// Climbs that are recorded and lived once more.
#include <gtest/gtest.h>

#include <filesystem>

#include "firmware/recording/replay.hpp"
#include "sim_stub/host/climb/climb.hpp"

namespace polygmap::sim {
namespace {

namespace fs = std::filesystem;

void expect_replay_of_a_climb(int steps, PlantKind plant, GaitPattern gait, NoiseKind noise, bool pictures = true) {
  const fs::path directory = fs::path(testing::TempDir()) / "polygmap_recorded_climb";
  std::error_code error;
  fs::remove_all(directory, error);
  ASSERT_TRUE(fs::create_directories(directory, error));
  ClimbOptions options;
  options.stairs.steps = steps;
  options.plant = plant;
  options.gait = gait;
  options.noise = noise;
  options.recording = (directory / "run.mcap").string();
  options.record_pictures = pictures;
  const ClimbSummary summary = run_climb(options, {});
  EXPECT_TRUE(summary.pass);
  const recording::ReplayResult result = recording::replay(options.recording);
  EXPECT_EQ(result.verdict, recording::ReplayVerdict::kSame) << recording::text_of(result);
  EXPECT_GT(result.ticks, 3000U);
  EXPECT_EQ(result.without_perception, !pictures);
  fs::remove_all(directory, error);
}

TEST(RecordedClimb, OneStep_NothingDiffersInTheReplay) {
  expect_replay_of_a_climb(1, PlantKind::kKinematic, GaitPattern::kDoubleStep, NoiseKind::kWhite);
}

TEST(RecordedClimb, WithoutPictures_PerceptionIsBelievedAndNothingElseDiffers) {
  expect_replay_of_a_climb(1, PlantKind::kKinematic, GaitPattern::kSingleStep, NoiseKind::kWhite, false);
}

TEST(LongRecordedClimbs, BothPlantsGaitsAndNoises_NothingDiffersInTheReplay) {
  for (const PlantKind plant : {PlantKind::kKinematic, PlantKind::kMujoco}) {
    for (const GaitPattern gait : {GaitPattern::kDoubleStep, GaitPattern::kSingleStep}) {
      for (const NoiseKind noise : {NoiseKind::kWhite, NoiseKind::kCorrelated}) {
        expect_replay_of_a_climb(2, plant, gait, noise);
      }
    }
  }
}

}  // namespace
}  // namespace polygmap::sim
