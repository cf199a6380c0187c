// SPDX-License-Identifier: Apache-2.0
// Each message that common tools read, taken apart by hand as its ROS 2 definition says.
#include "firmware/recording/topics/topics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace polygmap::recording {
namespace {

// CDR as ROS 2 has it, and nothing of the product's: a number lies at a multiple of its size, behind the first four
// bytes.
class Message {
 public:
  Message(Topic of, std::int64_t logged_ns, std::int64_t published_ns, std::span<const std::byte> bytes)
      : topic(of), log_ns(logged_ns), publish_ns(published_ns), bytes_(bytes.begin(), bytes.end()) {}

  template <class T>
  T get() {
    while ((at_ - 4) % sizeof(T) != 0) ++at_;
    T value{};
    EXPECT_LE(at_ + sizeof value, bytes_.size());
    if (at_ + sizeof value <= bytes_.size()) std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  double f64() { return get<double>(); }
  std::uint32_t u32() { return get<std::uint32_t>(); }
  std::uint8_t u8() { return get<std::uint8_t>(); }
  std::string text() {
    const std::size_t length = u32();
    EXPECT_TRUE(length > 0 && at_ + length <= bytes_.size());
    if (length == 0 || at_ + length > bytes_.size()) return {};
    std::string text(reinterpret_cast<const char*>(bytes_.data() + at_), length);
    at_ += length;
    EXPECT_EQ(text.back(), '\0');
    text.pop_back();
    return text;
  }
  std::int64_t stamp_ns() {
    const auto s = get<std::int32_t>();
    return s * kNsPerS + u32();
  }
  void expect_header(std::int64_t at_ns, const std::string& frame) {
    EXPECT_EQ(stamp_ns(), at_ns);
    EXPECT_EQ(text(), frame);
  }
  void expect_numbers(std::initializer_list<double> numbers) {
    for (const double number : numbers) EXPECT_EQ(f64(), number);
  }
  void expect_vector(const Vec3& v) { expect_numbers({v[0], v[1], v[2]}); }
  void expect_upright_pose(const Vec3& p) {
    expect_vector(p);
    expect_numbers({0.0, 0.0, 0.0, 1.0});
  }
  void expect_zeros(int count) {
    for (int i = 0; i < count; ++i) EXPECT_EQ(f64(), 0.0) << i;
  }
  void expect_end() const { EXPECT_EQ(at_, bytes_.size()); }

  Topic topic;
  std::int64_t log_ns, publish_ns;

 private:
  std::vector<std::byte> bytes_;
  std::size_t at_ = 4;
};

struct Collected final : MessageSink {
  std::vector<Message> messages;
  void take(Topic topic, std::int64_t log_ns, std::int64_t publish_ns,
            std::span<const std::byte> message) noexcept override {
    EXPECT_TRUE(message.size() >= 4 && message[0] == std::byte{0} && message[1] == std::byte{1}) << "little-endian CDR";
    messages.emplace_back(topic, log_ns, publish_ns, message);
  }
  Message& of(Topic topic) {
    const auto found = std::ranges::find(messages, topic, &Message::topic);
    EXPECT_NE(found, messages.end()) << name_of(topic);
    return *found;
  }
};

constexpr std::int64_t kFrame_ns = 7'000'000'000, kStamp_ns = 6'998'000'123;

class TopicsTest : public testing::Test {
 protected:
  // A row with one call of a port, or with outputs.
  RowCall& row_of(std::string_view task) {
    record_->kind = RecordKind::kRow;
    RowCall& row = record_->row;
    row.row = static_cast<std::size_t>(
        std::ranges::find_if(kTasks, [task](const Task& t) { return t.row.task == task; }) - kTasks.begin());
    row.cycle_ns = kFrame_ns;
    row.calls = {};
    row.progress = static_cast<std::uint8_t>(Progress::kDone);
    row.outputs = {};
    return row;
  }
  PortCall& call_of(std::string_view task, CallKind kind) {
    RowCall& row = row_of(task);
    row.calls = std::span(row.call_memory).first(1);
    PortCall& call = row.call_memory[0];
    call.kind = kind;
    call.gave = true;
    return call;
  }
  template <class... Outputs>
  void set_outputs(RowCall& row, const Outputs&... outputs) {
    memory_.resize(512U * 1024U);
    ByteWriter out(memory_);
    write_fields(out, [&](FieldWriter& writer) { (walk(writer, "", outputs), ...); });
    row.outputs = ByteReader(std::span<const std::byte>(memory_).first(out.size()));
  }
  void write() {
    collected_.messages.clear();
    topics_->write(*record_, collected_);
  }

  const std::unique_ptr<Topics> topics_ = std::make_unique<Topics>();
  const std::unique_ptr<Record> record_ = std::make_unique<Record>();
  std::vector<std::byte> memory_;
  Collected collected_;
};

TEST_F(TopicsTest, Imu_IsSensorMsgsImu) {
  call_of("sense", CallKind::kReadImu).imu = {kStamp_ns, {0.1, 0.2, 0.3}, {1.0, 2.0, 9.8}};
  write();
  ASSERT_EQ(collected_.messages.size(), 1U);
  Message& m = collected_.of(Topic::kImu);
  EXPECT_EQ(m.log_ns, kFrame_ns);
  EXPECT_EQ(m.publish_ns, kStamp_ns);
  m.expect_header(kStamp_ns, "base");
  m.expect_numbers({0.0, 0.0, 0.0, 1.0});
  EXPECT_EQ(m.f64(), -1.0) << "no orientation is measured";
  m.expect_zeros(8);
  m.expect_vector({0.1, 0.2, 0.3});
  m.expect_zeros(9);
  m.expect_vector({1.0, 2.0, 9.8});
  m.expect_zeros(9);
  m.expect_end();
}

TEST_F(TopicsTest, Joints_AreJointStatesAndTwoWrenches) {
  JointFeedback& joints = call_of("sense", CallKind::kReadJoints).joints;
  joints.stamp_ns = kStamp_ns;
  for (Eigen::Index i = 0; i < joints.q_rad.size(); ++i) {
    joints.q_rad[i] = 1.0 + static_cast<double>(i);
    joints.dq_radps[i] = 20.0 + static_cast<double>(i);
    joints.tau_nm[i] = 40.0 + static_cast<double>(i);
  }
  joints.foot_force_n = {300.0, 240.0};
  write();
  ASSERT_EQ(collected_.messages.size(), 3U);
  Message& m = collected_.of(Topic::kJoints);
  m.expect_header(kStamp_ns, "");
  ASSERT_EQ(m.u32(), kJointCount);
  for (const std::string_view name : kJointNames) EXPECT_EQ(m.text(), name);
  for (const double first : {1.0, 20.0, 40.0}) {
    ASSERT_EQ(m.u32(), kJointCount);
    for (std::size_t i = 0; i < kJointCount; ++i) EXPECT_EQ(m.f64(), first + static_cast<double>(i));
  }
  m.expect_end();
  for (std::size_t foot = 0; foot < 2; ++foot) {
    Message& wrench = collected_.messages[1 + foot];
    EXPECT_EQ(wrench.topic, Topic::kFeet);
    wrench.expect_header(kStamp_ns, foot == 0 ? "left_sole" : "right_sole");
    wrench.expect_numbers({0.0, 0.0, foot == 0 ? 300.0 : 240.0, 0.0, 0.0, 0.0});
    wrench.expect_end();
  }
}

TEST_F(TopicsTest, SampleThatDidNotCome_IsNoMessage) {
  for (const CallKind kind : {CallKind::kReadImu, CallKind::kReadJoints, CallKind::kReadLidar}) {
    call_of("sense", kind).gave = false;
    write();
    EXPECT_TRUE(collected_.messages.empty());
  }
}

TEST_F(TopicsTest, Lidar_IsNavMsgsOdometry) {
  call_of("sense", CallKind::kReadLidar).lio = {
      kStamp_ns, {Mat3::Identity(), {1.0, 2.0, 3.0}}, {0.1, 0.2, 0.3}, {0.5, 1.0, 2.0}};
  write();
  Message& m = collected_.of(Topic::kLio);
  m.expect_header(kStamp_ns, "lio");
  EXPECT_EQ(m.text(), "lidar");
  m.expect_upright_pose({1.0, 2.0, 3.0});
  const std::array<double, 6> variances{0.1 * 0.1, 0.2 * 0.2, 0.3 * 0.3, 0.25, 1.0, 4.0};
  for (std::size_t i = 0; i < 36; ++i) EXPECT_EQ(m.f64(), i % 7 == 0 ? variances[i / 7] : 0.0) << i;
  m.expect_zeros(6);
  EXPECT_EQ(m.f64(), -1.0) << "no twist is measured";
  m.expect_zeros(35);
  m.expect_end();
}

TEST_F(TopicsTest, Command_IsAJointStateAndItsGains) {
  PortCall& call = call_of("command", CallKind::kWriteJoints);
  call.gave = false;  // not all drives took it
  call.command.stamp_ns = kStamp_ns;
  for (std::size_t i = 0; i < kJointCount; ++i) {
    const double n = static_cast<double>(i);
    call.command.joints[i] = {n, 10.0 + n, 20.0 + n, 30.0 + n, 40.0 + n};
  }
  write();
  ASSERT_EQ(collected_.messages.size(), 2U);
  for (const auto& [topic, firsts] :
       {std::pair{Topic::kCommands, std::vector{0.0, 10.0, 20.0}}, std::pair{Topic::kGains, std::vector{30.0, 40.0}}}) {
    Message& m = collected_.of(topic);
    m.expect_header(kStamp_ns, "");
    ASSERT_EQ(m.u32(), kJointCount);
    for (const std::string_view name : kJointNames) EXPECT_EQ(m.text(), name);
    for (const double first : firsts) {
      ASSERT_EQ(m.u32(), kJointCount);
      for (std::size_t i = 0; i < kJointCount; ++i) EXPECT_EQ(m.f64(), first + static_cast<double>(i));
    }
    m.expect_end();
  }
}

// Odometry's axes turned by a quarter turn against the world's: pose in the world, speeds in the base.
TEST_F(TopicsTest, Estimate_IsNavMsgsOdometryAndTransforms) {
  topics_->set_camera({Mat3::Identity(), {0.1, 0.0, 0.2}});
  StateEstimate state;
  state.stamp_ns = kStamp_ns;
  state.world_T_odom = {rotation_z(0.5 * kPi), {10.0, 0.0, 0.0}};
  state.odom_T_base = {Mat3::Identity(), {1.0, 2.0, 0.8}};
  state.odom_v_base_mps = {0.4, 0.5, 0.6};
  state.base_w_base_radps = {0.01, 0.02, 0.03};
  EstimateQuality quality;
  for (int row = 0; row < 9; ++row) {
    for (int column = 0; column < 9; ++column) quality.covariance(row, column) = 10.0 * row + column;
  }
  set_outputs(row_of("estimate"), state, quality);
  write();
  Message& m = collected_.of(Topic::kOdometry);
  m.expect_header(kStamp_ns, "world");
  EXPECT_EQ(m.text(), "base");
  const Transform pose = state.world_T_base();
  m.expect_vector(pose.p_m);
  m.expect_numbers({0.0, 0.0});
  EXPECT_NEAR(m.f64(), std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(m.f64(), std::sqrt(0.5), 1e-12);
  for (const int row : {0, 1, 2, 6, 7, 8}) {
    for (const int column : {0, 1, 2, 6, 7, 8}) EXPECT_EQ(m.f64(), 10.0 * row + column);
  }
  m.expect_vector({0.4, 0.5, 0.6});
  m.expect_vector({0.01, 0.02, 0.03});
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      EXPECT_EQ(m.f64(), row < 3 && column < 3 ? 10.0 * (3 + row) + 3 + column : 0.0);
    }
  }
  m.expect_end();

  Message& tf = collected_.of(Topic::kTransforms);
  ASSERT_EQ(tf.u32(), 3U);
  tf.expect_header(kStamp_ns, "world");
  EXPECT_EQ(tf.text(), "odom");
  tf.expect_vector({10.0, 0.0, 0.0});
  for (int i = 0; i < 4; ++i) (void)tf.f64();
  tf.expect_header(kStamp_ns, "odom");
  EXPECT_EQ(tf.text(), "base");
  tf.expect_upright_pose({1.0, 2.0, 0.8});
  tf.expect_header(kStamp_ns, "base");
  EXPECT_EQ(tf.text(), "camera");
  tf.expect_upright_pose({0.1, 0.0, 0.2});
  tf.expect_end();
  int transforms = 0;
  for (int i = 0; i < 10; ++i) {
    write();
    transforms += collected_.messages.size() == 2 ? 1 : 0;
  }
  EXPECT_EQ(transforms, 2) << "every fifth";
}

TEST_F(TopicsTest, Picture_IsSensorMsgsImageAndCameraInfo) {
  const DepthFrameView frame{.stamp_ns = kStamp_ns, .sequence = 3, .width_px = 6, .height_px = 4};
  Message image(Topic::kDepth, 0, 0, topics_->image_head(frame));
  image.expect_header(kStamp_ns, "camera");
  EXPECT_EQ(image.u32(), 4U);
  EXPECT_EQ(image.u32(), 6U);
  EXPECT_EQ(image.text(), "16UC1");
  EXPECT_EQ(image.u8(), 0U);
  EXPECT_EQ(image.u32(), 12U);
  EXPECT_EQ(image.u32(), 48U) << "bytes, which follow";
  image.expect_end();

  const CameraIntrinsics camera{
      .width_px = 6, .height_px = 4, .fx_px = 50.0, .fy_px = 60.0, .cx_px = 2.5, .cy_px = 1.5};
  Message info(Topic::kCameraInfo, 0, 0, topics_->camera_info(camera, kStamp_ns));
  info.expect_header(kStamp_ns, "camera");
  EXPECT_EQ(info.u32(), 4U);
  EXPECT_EQ(info.u32(), 6U);
  EXPECT_EQ(info.text(), "plumb_bob");
  EXPECT_EQ(info.u32(), 0U);
  info.expect_numbers({50.0, 0.0, 2.5, 0.0, 60.0, 1.5, 0.0, 0.0, 1.0});
  info.expect_numbers({1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  info.expect_numbers({50.0, 0.0, 2.5, 0.0, 0.0, 60.0, 1.5, 0.0, 0.0, 0.0, 1.0, 0.0});
  for (int i = 0; i < 6; ++i) EXPECT_EQ(info.u32(), 0U);
  EXPECT_EQ(info.u8(), 0U);
  info.expect_end();
}

void expect_scene(Message& m, std::int64_t at_ns, std::uint32_t entities) {
  EXPECT_EQ(m.u32(), 1U) << "one deletion";
  EXPECT_EQ(m.stamp_ns(), at_ns);
  EXPECT_EQ(m.u8(), 1U) << "of all";
  EXPECT_EQ(m.text(), "");
  EXPECT_EQ(m.u32(), entities);
}
void expect_entity(Message& m, std::int64_t at_ns, const std::string& frame, const std::string& id) {
  m.expect_header(at_ns, frame);
  EXPECT_EQ(m.text(), id);
  EXPECT_EQ(m.stamp_ns(), 0);
  EXPECT_EQ(m.u8(), 0U);
}
void expect_line(Message& m, std::uint8_t type, std::span<const Vec3> points) {
  EXPECT_EQ(m.u8(), type);
  m.expect_upright_pose(Vec3::Zero());
  EXPECT_GT(m.f64(), 0.0) << "metres thick";
  EXPECT_EQ(m.u8(), 0U);
  ASSERT_EQ(m.u32(), points.size());
  for (const Vec3& point : points) m.expect_vector(point);
  for (int i = 0; i < 4; ++i) EXPECT_LE(m.f64(), 1.0);
  EXPECT_EQ(m.u32() + m.u32(), 0U);
}

SurfacePatch a_tread() {
  SurfacePatch tread;
  tread.kind = SurfaceKind::kTread;
  for (const Vec3& corner : {Vec3{1.0, 0.0, 0.1}, Vec3{1.0, 1.0, 0.1}, Vec3{2.0, 1.0, 0.1}, Vec3{2.0, 0.0, 0.1}}) {
    (void)tread.polygon.try_push_back(corner);
  }
  tread.nosing = {{1.0, 1.0, 0.1}, {1.0, 0.0, 0.1}, 0.002, true};
  tread.rmse_m = 0.25;
  return tread;
}
void expect_tread(Message& m) {
  const SurfacePatch tread = a_tread();
  const std::vector<Vec3> corners(tread.polygon.begin(), tread.polygon.end());
  ASSERT_EQ(m.u32(), 4U);
  EXPECT_EQ(m.text(), "kind");
  EXPECT_EQ(m.text(), "tread");
  EXPECT_EQ(m.text(), "offset_sigma_m");
  EXPECT_EQ(m.text(), "0");
  EXPECT_EQ(m.text(), "rmse_m");
  EXPECT_EQ(m.text(), "0.25");
  EXPECT_EQ(m.text(), "invalid_fraction");
  EXPECT_EQ(m.text(), "0");
  for (int i = 0; i < 4; ++i) EXPECT_EQ(m.u32(), 0U) << "no arrows, cubes, spheres, cylinders";
  ASSERT_EQ(m.u32(), 2U) << "outline and nosing";
  expect_line(m, 1, corners);
  const std::array<Vec3, 2> nosing{tread.nosing.a_m, tread.nosing.b_m};
  expect_line(m, 0, nosing);
  ASSERT_EQ(m.u32(), 1U) << "triangles";
  m.expect_upright_pose(Vec3::Zero());
  ASSERT_EQ(m.u32(), 4U);
  for (const Vec3& corner : corners) m.expect_vector(corner);
  for (int i = 0; i < 4; ++i) (void)m.f64();
  EXPECT_EQ(m.u32(), 0U) << "one colour";
  ASSERT_EQ(m.u32(), 6U);
  for (const std::uint32_t index : {0U, 1U, 2U, 0U, 2U, 3U}) EXPECT_EQ(m.u32(), index);
  EXPECT_EQ(m.u32() + m.u32(), 0U) << "no texts, no models";
}

TEST_F(TopicsTest, Surfaces_AreASceneInTheCamera) {
  const auto frame = std::make_unique<SurfaceFrame>();
  frame->stamp_ns = kStamp_ns;
  (void)frame->surfaces.try_push_back(a_tread());
  set_outputs(row_of("surfaces"), *frame);
  write();
  Message& m = collected_.of(Topic::kSurfaces);
  EXPECT_EQ(m.publish_ns, kStamp_ns);
  expect_scene(m, kStamp_ns, 1);
  expect_entity(m, kStamp_ns, "camera", "surface 0");
  expect_tread(m);
  m.expect_end();
  record_->row.progress = static_cast<std::uint8_t>(Progress::kBusy);
  write();
  EXPECT_TRUE(collected_.messages.empty()) << "there is none before it is done";
}

TEST_F(TopicsTest, Map_IsASceneInOdometry) {
  const auto map = std::make_unique<MapSnapshot>();
  map->stamp_ns = kStamp_ns;
  MapPolygon polygon;
  polygon.surface = a_tread();
  polygon.id = 42;
  (void)map->polygons.try_push_back(polygon);
  set_outputs(row_of("map"), *map);
  write();
  Message& m = collected_.of(Topic::kMap);
  expect_scene(m, kStamp_ns, 1);
  expect_entity(m, kStamp_ns, "odom", "polygon 42");
  expect_tread(m);
  m.expect_end();
}

// As many surfaces as a frame can have, with all their corners: the longest message there is.
TEST_F(TopicsTest, FullMap_IsAMessageAllTheSame) {
  const auto map = std::make_unique<MapSnapshot>();
  MapPolygon polygon;
  polygon.surface.nosing.valid = true;
  while (polygon.surface.polygon.try_push_back(Vec3::Ones())) {
  }
  while (map->polygons.try_push_back(polygon)) {
  }
  memory_.resize(4U << 20U);
  set_outputs(row_of("map"), *map);
  write();
  EXPECT_EQ(topics_->too_long(), 0U);
  expect_scene(collected_.of(Topic::kMap), 0, static_cast<std::uint32_t>(map->polygons.size()));
}

TEST_F(TopicsTest, Footholds_AreCubesAsLargeAsSoles) {
  FootholdSet footholds;
  footholds.map_stamp_ns = kStamp_ns;
  footholds.has_p_star = true;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    footholds.p_star_feet[foot].position_m = {1.0, foot == 0 ? 0.1 : -0.1, 0.13};
    footholds.p_star_feet[foot].clearance_m = 0.5;
    footholds.p_star_feet[foot].toe_clearance_m = 0.25;
  }
  set_outputs(row_of("footholds"), footholds);
  write();
  Message& m = collected_.of(Topic::kFootholds);
  expect_scene(m, kFrame_ns, 1);
  expect_entity(m, kFrame_ns, "odom", "p*");
  ASSERT_EQ(m.u32(), 4U);
  for (int foot = 0; foot < 2; ++foot) {
    EXPECT_EQ(m.text(), "clearance_m");
    EXPECT_EQ(m.text(), "0.5");
    EXPECT_EQ(m.text(), "toe_clearance_m");
    EXPECT_EQ(m.text(), "0.25");
  }
  EXPECT_EQ(m.u32(), 0U) << "arrows";
  ASSERT_EQ(m.u32(), 2U) << "cubes";
  for (const double y : {0.1, -0.1}) {
    m.expect_upright_pose({1.0, y, 0.13});
    m.expect_numbers({0.26, 0.096, 0.004});
    for (int i = 0; i < 4; ++i) (void)m.f64();
  }
  for (int i = 0; i < 6; ++i) EXPECT_EQ(m.u32(), 0U);
  m.expect_end();
  footholds.has_p_star = false;
  set_outputs(row_of("footholds"), footholds);
  write();
  expect_scene(collected_.of(Topic::kFootholds), kFrame_ns, 0);
}

TEST_F(TopicsTest, Cycle_IsWhatTheExecutiveDid) {
  RowCall& row = row_of("surfaces");
  row.units = 100;
  row.units_left = 30;
  row.progress = static_cast<std::uint8_t>(Progress::kBusy);
  const auto surfaces = static_cast<unsigned>(row.row);
  write();
  record_->kind = RecordKind::kCycle;
  record_->cycle_lane = kPerceptionLane;
  record_->cycle = {.cycle = 9,
                    .due_ns = kFrame_ns,
                    .ran = 1U << surfaces,
                    .shed = 2U << surfaces,
                    .caught_up = true,
                    .skipped_before = 4};
  write();
  Message& m = collected_.of(Topic::kFrame);
  m.expect_header(kFrame_ns, "");
  EXPECT_EQ(m.u8(), kPerceptionLane);
  EXPECT_EQ(m.get<std::uint64_t>(), 9U);
  ASSERT_EQ(m.u32(), 2U);
  EXPECT_EQ(m.text(), "surfaces");
  EXPECT_EQ(m.text(), "map");
  for (const auto& [first, second] :
       {std::pair{1, 0}, std::pair{0, 1}, std::pair{0, 0}, std::pair{0, 0}}) {  // ran, shed ...
    ASSERT_EQ(m.u32(), 2U);
    EXPECT_EQ(m.u8(), first);
    EXPECT_EQ(m.u8(), second);
  }
  ASSERT_EQ(m.u32(), 2U);
  EXPECT_EQ(m.get<std::int32_t>(), 70) << "work units";
  EXPECT_EQ(m.get<std::int32_t>(), 0);
  EXPECT_EQ(m.u8(), 0U);
  EXPECT_EQ(m.u8(), 1U);
  EXPECT_EQ(m.get<std::uint64_t>(), 4U);
  m.expect_end();
}

}  // namespace
}  // namespace polygmap::recording
