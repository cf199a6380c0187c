// SPDX-License-Identifier: Apache-2.0
// guest_plant BUS_FILE REQUESTS PICTURES ...: the simulated robot on its stairs, in closed loop and real time, as a
// process of its own in the guest. Its drives and the feet's board are on the CAN buses, its IMU is a Livox Mid-360's
// datagrams, poses of a lidar odometry come as datagrams, and its camera is vivid, shown what the host renders from
// where the robot is (picture_request.hpp); REQUESTS and PICTURES are named pipes of the host. It listens on the
// abstract socket of --notify as a service manager does. It says "PLANT ready" when all is there and "PLANT climbed"
// when both feet rest on the last tread; it ends with SIGTERM, and prints "PLANT steps= ..." and what the daemon told.
#include <arpa/inet.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <ctime>
#include <vector>

#include "firmware/config/bus_file.hpp"
#include "hal/codec/lio_packet.hpp"
#include "hal/codec/livox_packet.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/vm/picture_request.hpp"
#include "tests/vm/plant_options.hpp"
#include "tests/vm/semihosting.hpp"
#include "tests/vm/vivid_output.hpp"

namespace polygmap::sim {

std::unique_ptr<Plant> make_mujoco_plant(const MujocoPlant::Params&, const StairWorld&, const RobotErrors&,
                                         const Transform&, const JointVector&, double) {
  vm::refuse("there is no physics in the guest");
}

}  // namespace polygmap::sim

namespace polygmap::vm {
namespace {

using What = PlantInjection::What;

constexpr std::int64_t kTick_ns = sim::VirtualClock::kTick_ns;

volatile sig_atomic_t ended = 0;

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerS + now.tv_nsec;
}

// Shows, some milliseconds before the camera takes its next picture, what was to be seen when that one was exposed.
class Camera {
 public:
  Camera(VividOutput& output, const PlantOptions& options)
      : output_(output),
        latency_ns_(options.latency_ns),
        requests_(options.requests, HostFile::Mode::kWrite),
        pictures_(options.pictures, HostFile::Mode::kRead) {
    if (!requests_.is_open() || !pictures_.is_open()) refuse("the host's renderer cannot be reached");
  }

  void tick(std::int64_t tick, std::int64_t now_ns, const sim::SimRobot& robot) {
    if (tick == 1) past_.fill(PictureMoment::of(robot));
    at(tick) = PictureMoment::of(robot);
    if (first_ns_ < 0) {
      if (!output_.input_is_taken()) return;
      first_ns_ = now_ns;
    }
    const std::int64_t due_ns = first_ns_ + taken_ * kNsPerS / 30;
    if (now_ns < due_ns - kAhead_ns) return;
    const std::int64_t ago_ticks = (now_ns - (due_ns - latency_ns_) + kTick_ns / 2) / kTick_ns;
    const std::int64_t middle = tick - std::max(ago_ticks, kHalfScan_ticks);
    const PictureRequest request{static_cast<std::uint64_t>(taken_),
                                 1e-9 * static_cast<double>(std::max<std::int64_t>(middle, 0) * kTick_ns),
                                 at(middle - kHalfScan_ticks), at(middle + kHalfScan_ticks)};
    ++taken_;
    if (!requests_.write(&request, sizeof request) || !pictures_.read(pixels_.data(), pixels_.size())) {
      refuse("the host's renderer has ended");
    }
    output_.show(pixels_.data());
  }
  [[nodiscard]] std::int64_t shown() const noexcept { return taken_; }

 private:
  static constexpr std::int64_t kAhead_ns = 8 * kNsPerMs;
  static constexpr std::int64_t kHalfScan_ticks = 4;  // as the simulated camera scans
  [[nodiscard]] PictureMoment& at(std::int64_t tick) noexcept {
    return past_[static_cast<std::size_t>(tick + 64) % past_.size()];
  }

  VividOutput& output_;
  const std::int64_t latency_ns_;
  const HostFile requests_, pictures_;
  std::array<PictureMoment, 64> past_{};
  std::vector<char> pixels_ = std::vector<char>(VividOutput::kPicture_bytes);
  std::int64_t first_ns_ = -1, taken_ = 0;
};

class Plant {
 public:
  Plant(const PlantOptions& options, VividOutput& output)
      : options_(options),
        bus_(config::read_bus(options.bus_file)),
        robot_(sim_options(options.seed, options.steps)),
        camera_(output, options),
        udp_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    for (const std::string& bus : bus_.buses) sockets_.push_back({open_bus(bus), POLLIN, 0});
    const What what = options.injection.what;
    const std::size_t count = what == What::kBusOff || what == What::kGarbage ? bus_.buses.size() : kJointCount;
    if (options.injection.number >= count) refuse("--inject names none of " + std::to_string(count));
    if (!options.notify.empty()) sockets_.push_back({open_notify(options.notify), POLLIN, 0});
    witnessed_.reserve(kMostWitnessed);
    told_.reserve(4096);
    (void)robot_.try_read(feedback_);
  }

  void run() {
    begin_ns_ = monotonic_ns();
    for (std::int64_t tick = 1; ended == 0;) {
      const std::int64_t due_ns = begin_ns_ + tick * kTick_ns, left_ns = due_ns - monotonic_ns();
      const timespec wait{0, std::max<std::int64_t>(left_ns, 0)};
      if (left_ns > 0 && ppoll(sockets_.data(), sockets_.size(), &wait, nullptr) > 0) {
        for (std::size_t bus = 0; bus < bus_.buses.size(); ++bus) read_bus(bus);
        if (sockets_.size() > bus_.buses.size()) read_notify(sockets_.back().fd);
        continue;
      }
      late_max_ns_ = std::max(late_max_ns_, -left_ns);
      live(tick++, due_ns);
    }
  }
  void print() const {
    const sim::Truth& truth = robot_.truth();
    const std::string_view support = truth.in_contact[0] && truth.in_contact[1] ? "both"
                                     : truth.in_contact[0]                      ? "left"
                                     : truth.in_contact[1]                      ? "right"
                                                                                : "none";
    std::printf(
        "PLANT steps=%d of=%d fell=%d support=%.*s commands=%zu enters=%zu pictures=%lld "
        "late_max_us=%lld refused=%zu unwitnessed=%zu down_s=%.3f\n",
        steps_climbed_, options_.steps, truth.fell ? 1 : 0, static_cast<int>(support.size()), support.data(), commands_,
        enters_, static_cast<long long>(camera_.shown()), static_cast<long long>(late_max_ns_ / 1000), refused_,
        unwitnessed_, 1e-9 * static_cast<double>(in_the_air_ns_ - gains_ns_));
    if (options_.injection.what != What::kNothing && !fault_has_begun_) {
      std::printf("the fault was never injected: the climb had ended at %.2f s\n",
                  gains_ns_ < 0 ? 0.0 : 1e-9 * static_cast<double>(monotonic_ns() - gains_ns_));
    }
    if (truth.fell) std::printf("PLANT fell: %s\n", truth.fall_reason.c_str());
    for (const Told& told : told_) std::printf("TOLD %.3f %s\n", told.since_s, told.state.c_str());
  }
  void write_witness() const {
    if (options_.witness.empty()) return;
    std::FILE* file = std::fopen(options_.witness.c_str(), "w");
    if (file == nullptr) refuse("cannot write " + options_.witness);
    for (const Witnessed& w : witnessed_) {
      std::fprintf(file, "(%lld.%06lld) %s %03X#", static_cast<long long>(w.at_ns / kNsPerS),
                   static_cast<long long>(w.at_ns % kNsPerS / 1000), bus_.buses[w.bus].c_str(), w.id);
      for (const std::uint8_t byte : w.bytes) std::fprintf(file, "%02X", byte);
      std::fputc('\n', file);
    }
    std::fclose(file);
  }

 private:
  static constexpr std::size_t kMostWitnessed = 12 * 500 * 60;  // a minute
  struct Drive {
    bool enabled = false, has_gains = false;
    JointSetpoint command;
  };
  struct Witnessed {
    std::int64_t at_ns;
    std::uint8_t bus, id;
    hal::MitBytes bytes;
  };
  struct Told {
    double since_s;  // since the first command with gains
    std::string state;
  };

  static int open_bus(const std::string& name) {
    const int bus = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(name.c_str()));
    if (bus < 0 || bind(bus, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) refuse("no bus " + name);
    return bus;
  }
  static int open_notify(const std::string& name) {
    const int listens = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(static_cast<char*>(address.sun_path) + 1, name.c_str(), name.size());
    const auto bytes = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
    if (bind(listens, reinterpret_cast<sockaddr*>(&address), bytes) != 0) refuse("cannot listen on @" + name);
    return listens;
  }
  void read_notify(int listens) {
    std::array<char, 1024> text{};
    for (ssize_t n = 0; (n = recv(listens, text.data(), text.size(), 0)) >= 0;) {
      const double since_s = gains_ns_ < 0 ? -1.0 : 1e-9 * static_cast<double>(monotonic_ns() - gains_ns_);
      if (told_.size() < told_.capacity()) {
        told_.push_back({since_s, std::string(text.data(), static_cast<std::size_t>(n))});
      }
    }
  }
  [[nodiscard]] bool injected(What what) {
    if (gains_ns_ < 0) return false;
    const std::int64_t since_ns = monotonic_ns() - gains_ns_;
    fault_has_begun_ |= options_.injection.has_begun(what, since_ns);
    return options_.injection.is_on(what, since_ns);
  }
  [[nodiscard]] bool injected(What what, std::size_t number) {
    return options_.injection.number == number && injected(what);
  }

  void read_bus(std::size_t bus) {
    can_frame frame{};
    while (read(sockets_[bus].fd, &frame, sizeof frame) == sizeof frame) {
      for (std::size_t n = 0; n < kJointCount; ++n) {
        const hal::CanDrive& drive = bus_.table.drives[n];
        if (drive.bus == bus && drive.id == frame.can_id && frame.len == 8) take(n, drive, frame);
      }
    }
  }
  void take(std::size_t n, const hal::CanDrive& description, const can_frame& frame) {
    hal::MitBytes bytes{};
    std::memcpy(bytes.data(), frame.data, bytes.size());
    witness(description, bytes);
    if (injected(What::kUnplug, n) || injected(What::kBusOff, description.bus)) return;
    Drive& drive = drives_[n];
    JointSetpoint command;
    if (bytes == hal::special_frame(hal::MitSpecial::kEnter)) {
      ++enters_;
      drive.enabled = true;
    } else if (bytes == hal::special_frame(hal::MitSpecial::kExit)) {
      drive.enabled = false;
    } else if (drive.enabled && hal::try_decode_command(bytes, description.ranges, command)) {
      ++commands_;
      if (command.kp_nmprad > 0.0) {  // without gains a joint stays where it is: something else holds the robot
        drive.has_gains = true;
        drive.command = command;
        if (gains_ns_ < 0) gains_ns_ = monotonic_ns();
      }
    }
    reply(n, description);
    if (injected(What::kDuplicate, n)) reply(n, description);
  }
  void witness(const hal::CanDrive& drive, const hal::MitBytes& bytes) {
    if (witnessed_.size() == witnessed_.capacity()) return static_cast<void>(++unwitnessed_);
    witnessed_.push_back(
        {monotonic_ns(), static_cast<std::uint8_t>(drive.bus), static_cast<std::uint8_t>(drive.id), bytes});
  }
  void reply(std::size_t n, const hal::CanDrive& drive) {
    if (injected(What::kGap)) return;
    const auto i = static_cast<Eigen::Index>(n);
    hal::MitReply reply;
    reply.p_rad = feedback_.q_rad[i];
    reply.v_radps = feedback_.dq_radps[i];
    reply.t_nm = feedback_.tau_nm[i];
    reply.status = drive.reply == hal::MitReplyRule::kStatusNibble && drives_[n].enabled ? 1 : 0;
    send(drive.bus, drive.reply_id, hal::reply_frame(reply, drive.id, drive.ranges, drive.reply));
  }

  void live(std::int64_t tick, std::int64_t due_ns) {
    JointCommand command;
    command.stamp_ns = due_ns;
    const bool all = std::ranges::all_of(drives_, &Drive::has_gains);
    for (std::size_t n = 0; n < kJointCount; ++n) command.joints[n] = drives_[n].command;
    if (all) (void)robot_.try_write(command);
    robot_.advance();
    (void)robot_.try_read(feedback_);
    sense(due_ns);
    disturb();
    camera_.tick(tick, due_ns, robot_);
    count_steps();
    const sim::Truth& truth = robot_.truth();
    if (!truth.in_contact[0] || !truth.in_contact[1]) in_the_air_ns_ = due_ns;
  }
  void sense(std::int64_t now_ns) {
    const hal::CanFeet& feet = bus_.table.feet;
    if (feet.present && !injected(What::kGap) && !injected(What::kBusOff, feet.bus)) {
      send(feet.bus, feet.id, hal::feet_frame(feedback_.foot_force_n, feet.unit_n));
    }
    const std::int64_t offset_ns = now_ns - robot_.now_ns();  // of this machine's clock to the simulation's
    ImuSample imu;
    while (static_cast<hal::Imu&>(robot_).try_read(imu)) {
      codec::LivoxImuPacket packet;
      packet.udp_count = ++imu_count_;
      packet.stamp_ns = imu.stamp_ns + offset_ns;
      for (std::size_t i = 0; i < 3; ++i) {
        packet.gyro_radps[i] = static_cast<float>(imu.gyro_radps[static_cast<Eigen::Index>(i)]);
        packet.accel_mps2[i] = static_cast<float>(imu.accel_mps2[static_cast<Eigen::Index>(i)]);
      }
      std::array<std::uint8_t, codec::kLivoxImuPacket_bytes> bytes{};
      codec::encode(packet, bytes);
      send_datagram(options_.imu_port, bytes);
    }
    LioSample lio;
    while (static_cast<hal::LidarOdometry&>(robot_).try_read(lio)) {
      codec::LioPacket packet;
      packet.sequence = ++lio_count_;
      packet.stamp_ns = lio.stamp_ns + offset_ns;
      const Eigen::Quaterniond q(lio.lio_T_lidar.R);
      packet.rotation_wxyz = {q.w(), q.x(), q.y(), q.z()};
      for (std::size_t i = 0; i < 3; ++i) {
        const auto at = static_cast<Eigen::Index>(i);
        packet.position_m[i] = lio.lio_T_lidar.p_m[at];
        packet.position_sigma_m[i] = lio.position_sigma_m[at];
        packet.rotation_sigma_rad[i] = lio.rotation_sigma_rad[at];
      }
      std::array<std::uint8_t, codec::kLioPacket_bytes> bytes{};
      codec::encode(packet, bytes);
      send_datagram(options_.lio_port, bytes);
    }
  }
  // What a bus does by itself: its controller says that it left, or is back; and frames that nobody sends.
  void disturb() {
    const bool off = injected(What::kBusOff);
    if (off != was_off_) {
      can_frame error{};
      error.can_id = CAN_ERR_FLAG | (off ? CAN_ERR_BUSOFF : CAN_ERR_RESTARTED);
      error.len = CAN_ERR_DLC;
      write_frame(options_.injection.number, error);
    }
    was_off_ = off;
    for (int i = 0; injected(What::kGarbage) && i < 4; ++i) {  // any identifier, any length, any bytes
      seed_ = seed_ * 6364136223846793005U + 1442695040888963407U;
      can_frame frame{};
      frame.can_id = static_cast<canid_t>(seed_ >> 53U) & CAN_SFF_MASK;
      frame.len = static_cast<__u8>((seed_ >> 40U) % 9);
      std::memcpy(frame.data, &seed_, sizeof seed_);
      write_frame(options_.injection.number, frame);
    }
  }
  // As the simulation's report does: both soles rest on a step, inside its edges, for a twentieth of a second.
  void count_steps() {
    constexpr int kRest_ticks = 25;
    const sim::Truth& truth = robot_.truth();
    const int step = std::min(truth.step_index[0], truth.step_index[1]);
    bool rests = step >= 0 && truth.in_contact[0] && truth.in_contact[1] && !truth.fell;
    for (std::size_t foot = 0; rests && foot < kFootCount; ++foot) {
      rests = sim::sole_margin_m(truth.true_T_sole[foot], robot_.stairs(), truth.step_index[foot]) >= 0.0;
    }
    rested_ticks_ = rests && step == resting_step_ ? rested_ticks_ + 1 : 0;
    resting_step_ = rests ? step : -1;
    if (rested_ticks_ != kRest_ticks || climbed_[static_cast<std::size_t>(step)]) return;
    climbed_[static_cast<std::size_t>(step)] = true;
    ++steps_climbed_;
    if (step + 1 != options_.steps) return;
    std::printf("PLANT climbed\n");
    std::fflush(stdout);
  }

  template <std::size_t Bytes>
  void send(std::size_t bus, std::uint32_t id, const std::array<std::uint8_t, Bytes>& bytes) {
    can_frame frame{};
    frame.can_id = id;
    frame.len = Bytes;
    std::memcpy(frame.data, bytes.data(), Bytes);
    write_frame(bus, frame);
  }
  void write_frame(std::size_t bus, const can_frame& frame) {
    if (bus >= bus_.buses.size()) refuse("there is no bus " + std::to_string(bus));
    if (write(sockets_[bus].fd, &frame, sizeof frame) != sizeof frame) ++refused_;
  }
  template <std::size_t Bytes>
  void send_datagram(int port, const std::array<std::uint8_t, Bytes>& bytes) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (sendto(udp_, bytes.data(), Bytes, 0, reinterpret_cast<sockaddr*>(&to), sizeof to) < 0) ++refused_;
  }

  const PlantOptions& options_;
  const config::BusFile bus_;
  sim::SimRobot robot_;
  Camera camera_;
  std::vector<pollfd> sockets_;  // the buses', then the service manager's
  int udp_;
  std::array<Drive, kJointCount> drives_;
  JointFeedback feedback_;  // as the last tick left it
  std::int64_t begin_ns_ = 0, gains_ns_ = -1, late_max_ns_ = 0;
  std::int64_t in_the_air_ns_ = 0;  // when a foot was it last
  std::uint16_t imu_count_ = 0;
  std::uint32_t lio_count_ = 0;
  bool was_off_ = false, fault_has_begun_ = false;
  std::uint64_t seed_ = 1;
  std::array<bool, 64> climbed_{};
  int steps_climbed_ = 0, rested_ticks_ = 0, resting_step_ = -1;
  std::size_t commands_ = 0, enters_ = 0, refused_ = 0, unwitnessed_ = 0;
  std::vector<Witnessed> witnessed_;
  std::vector<Told> told_;
};

int run(const PlantOptions& options) {
  VividOutput output;
  if (const std::string wrong = output.open("/dev/video0", "/dev/video1"); !wrong.empty()) refuse("vivid: " + wrong);
  Plant plant(options, output);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) refuse("cannot lock its memory");
  // Below both lanes: it answers when they have done their cycle.
  const sched_param scheduling{.sched_priority = 60};
  if (sched_setscheduler(0, SCHED_FIFO, &scheduling) != 0) refuse("cannot have a real-time priority");
  for (const int number : {SIGTERM, SIGINT}) signal(number, [](int) { ended = 1; });
  std::printf("PLANT ready\n");
  std::fflush(stdout);
  plant.run();
  plant.print();
  plant.write_witness();
  return 0;
}

}  // namespace
}  // namespace polygmap::vm

int main(int argc, char** argv) { return polygmap::vm::run(polygmap::vm::parse_options(argc, argv)); }
