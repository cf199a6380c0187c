// SPDX-License-Identifier: Apache-2.0
// A recording whose bytes were changed at random, read from memory: what is taken lies within what a recording may say,
// and of anything else the reader says one sentence.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>
#include <string>

#include "firmware/config/param_table.hpp"
#include "firmware/recording/recording_file.hpp"
#include "tests/firmware/recording/recorded_run.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::recording {
namespace recording_fuzz_test {
namespace {

// A robot that stands, for some ticks.
std::string recorded(int ticks) {
  const RecordingFolder folder("fuzz");
  {
    RecordedRun run(folder.file());
    run.run(ticks);
    run.finish();
  }
  const Bytes bytes = read_file(folder.file());
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void mutate(std::string& bytes, std::mt19937_64& random) {
  const auto any = [&] { return static_cast<std::size_t>(random() % bytes.size()); };
  for (std::uint64_t changes = 1 + random() % 3; changes > 0 && !bytes.empty(); --changes) {
    const std::size_t at = any(), length = std::min<std::size_t>(1 + random() % 16, bytes.size() - at);
    switch (random() % 8) {
      case 0:
        bytes.erase(at, length);
        break;
      case 1:
        bytes.insert(at, bytes.substr(any(), length));
        break;
      case 2:
        bytes.replace(at, length, length, random() % 2 == 0 ? '\xFF' : '\x7F');
        break;
      case 3:
        if (random() % 8 == 0) bytes.resize(at);
        break;
      case 4:
        for (std::size_t i = at; i < at + length; ++i) bytes[i] = static_cast<char>(random());
        break;
      default:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
    }
  }
}

void expect_sentence(const RecordingFile& file, std::size_t size) {
  const std::string& sentence = file.complaint();
  ASSERT_TRUE(sentence.starts_with("\"memory\"") && sentence.ends_with('.')) << sentence;
  ASSERT_TRUE(std::ranges::all_of(sentence, [](char c) { return c >= ' ' && c <= '~'; })) << sentence;
  const std::size_t at = sentence.find("\", byte ");
  ASSERT_TRUE(at != std::string::npos || sentence.starts_with("\"memory\" is no recording")) << sentence;
  if (at != std::string::npos) {
    ASSERT_LE(std::stoull(sentence.substr(at + 8)), size) << sentence;
  }
}

struct IsWithin {
  const config::Param& param;
  [[nodiscard]] bool one(double x) const { return x >= param.least && x <= param.most; }
  bool operator()(config::EnumValue choice) const { return *choice.value < choice.names.size(); }
  bool operator()(config::RotationValue rotation) const {
    return (*rotation.value * rotation.value->transpose() - Mat3::Identity()).norm() < 1e-8;
  }
  bool operator()(std::span<double> values) const {
    return std::ranges::all_of(values, [&](double x) { return one(x); });
  }
  bool operator()(const auto*) const { return one(config::number_of(param)); }
};
void expect_params(Params params) {
  for (const config::Param& param : config::param_table(params).params) {
    ASSERT_TRUE(std::visit(IsWithin{param}, param.value)) << param.name;
  }
}

void expect_row(const RowCall& row) {
  ASSERT_LT(row.row, kTasks.size());
  ASSERT_TRUE(row.cycle_ns >= 0 && row.cycle_ns <= kLatest_ns);
  ASSERT_LE(row.calls.size(), kMaxCallsPerRow);
  for (const PortCall& call : row.calls) {
    ASSERT_TRUE(call.kind >= CallKind::kReadImu && call.kind <= CallKind::kReadOperator);
    ASSERT_TRUE(call.kind != CallKind::kAcquire || !call.gave || call.picture.pixels <= Pixels::kOtherSize);
  }
}
RecordingFile::Found read(RecordingFile& file, Record& record, std::uint64_t& records) {
  RecordingFile::Found found{};
  while (!testing::Test::HasFatalFailure() && (found = file.read(record)) == RecordingFile::Found::kRecord) {
    ++records;
    if (record.kind == RecordKind::kRow) expect_row(record.row);
    EXPECT_TRUE(record.kind != RecordKind::kEvent || record.event.lane < kLaneCount);
    EXPECT_TRUE(record.kind != RecordKind::kCycle || record.cycle_lane < kLaneCount);
    EXPECT_TRUE(record.kind != RecordKind::kLost || record.lost_lane < kLaneCount);
  }
  return found;
}

void fuzz_recording(int runs, unsigned seed) {
  const std::string good = recorded(2);
  std::mt19937_64 random(seed);
  const auto record = std::make_unique<Record>();
  int opened_ones = 0, read_to_the_end = 0, suspicious = 0;
  std::uint64_t records = 0;
  for (int run = 0; run < runs && !testing::Test::HasFatalFailure(); ++run) {
    std::string bytes = good;
    if (run > 0) mutate(bytes, random);
    if (bytes.empty()) continue;  // no memory to read from
    RecordingFile file;
    const bool is_open = file.open("memory", ::fmemopen(bytes.data(), bytes.size(), "rb"));
    const RecordingFile::Found found = is_open ? read(file, *record, records) : RecordingFile::Found::kBad;
    if (found == RecordingFile::Found::kBad && !testing::Test::HasFatalFailure()) expect_sentence(file, bytes.size());
    if (is_open && ++opened_ones % 100 == 1) expect_params(file.params());
    read_to_the_end += found == RecordingFile::Found::kEnd ? 1 : 0;
    suspicious += file.damage().empty() && file.contradiction().empty() ? 0 : 1;
    ASSERT_TRUE(run > 0 || (found == RecordingFile::Found::kEnd && suspicious == 0)) << file.complaint();
  }
  EXPECT_GT(opened_ones, runs / 20);
  EXPECT_LT(opened_ones, runs - runs / 20);
  EXPECT_GT(read_to_the_end, runs / 100);
  EXPECT_GT(suspicious, runs / 20);
  EXPECT_GT(records, static_cast<std::uint64_t>(runs) / 10);
}
TEST(RecordingFile, AnyBytes_AreWithinItsRangesOrASentence) { fuzz_recording(test::kSlowMachine ? 500 : 3'000, 1); }
TEST(LongFuzzRecordingFile, AnyBytes_AreWithinItsRangesOrASentence) { fuzz_recording(1'000'000, 2); }

}  // namespace
}  // namespace recording_fuzz_test
}  // namespace polygmap::recording
