// SPDX-License-Identifier: Apache-2.0
// guest_robot BUS_FILE [--imu PORT] [--stranger PORT] [--mute DRIVE] [--unplug DRIVE@S] [--notify NAME]: a robot that
// stands, as a process of its own on the guest's CAN buses: each drive answers its commands and follows them at once,
// the feet's board and the IMU (a Livox Mid-360's datagrams) speak once a cycle. To --stranger, poses of a lidar
// odometry go ten times a second, good ones, from an address that nobody configured. DRIVE is a joint's index; a mute
// one never answers, an unplugged one not from S seconds on. It listens on the abstract socket NAME as a service
// manager does. It ends with SIGTERM, and prints "ROBOT commands= ..." and what the daemon told. guest_robot
// --as-nobody PROGRAM ARGUMENT...: the program without any right of root. guest_robot --black DEVICE: vivid's pictures
// have no depth in them.
#include <arpa/inet.h>
#include <fcntl.h>
#include <grp.h>
#include <linux/can/raw.h>
#include <linux/videodev2.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/robot/leg_kinematics.hpp"
#include "algorithms/robot/robot_model.hpp"
#include "firmware/config/bus_file.hpp"
#include "hal/codec/lio_packet.hpp"
#include "hal/codec/livox_packet.hpp"

namespace polygmap::vm {
namespace {

constexpr double kHalfWeight_n = 270.0;
constexpr std::uint32_t kStranger = INADDR_LOOPBACK + 1;  // 127.0.0.2, an address of this machine, too
constexpr unsigned kCyclesPerPose = 50;

[[noreturn]] void refuse(const std::string& why) {
  std::fprintf(stderr, "guest_robot: %s\n", why.c_str());
  std::exit(2);
}
std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kNsPerS + now.tv_nsec;
}

struct Options {
  std::string bus_file;
  int imu_port = 56401;
  int stranger_port = 0;  // 0: there is none
  std::size_t mute = kJointCount, unplugged = kJointCount;
  double unplugged_s = 0.0;
  std::string notify;
};

volatile sig_atomic_t ended = 0;

class StandingRobot {
 public:
  explicit StandingRobot(const Options& options) : options_(options), bus_(config::read_bus(options.bus_file)) {
    const NominalStance stance;
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      const Transform sole{Mat3::Identity(), Vec3{0, side_sign(foot) * stance.half_width_m, -stance.base_height_m}};
      q_rad_.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) = solve_leg({}, foot, sole).q_rad;
    }
    for (const std::string& bus : bus_.buses) sockets_.push_back({open_bus(bus), POLLIN, 0});
    udp_ = socket(AF_INET, SOCK_DGRAM, 0);
    if (options.stranger_port != 0) stranger_ = open_stranger();
    if (!options.notify.empty()) sockets_.push_back({open_notify(options.notify), POLLIN, 0});
    told_.reserve(4096);
  }
  void run() {
    begin_ns_ = monotonic_ns();
    while (ended == 0) {
      if (poll(sockets_.data(), sockets_.size(), 100) <= 0) continue;
      for (std::size_t bus = 0; bus < bus_.buses.size(); ++bus) read_bus(bus);
      if (sockets_.size() > bus_.buses.size()) read_notify(sockets_.back().fd);
    }
  }
  void print() const {
    std::printf("ROBOT commands=%zu enters=%zu exits=%zu gains=%d poses=%u\n", commands_, enters_, exits_,
                has_gains_ ? 1 : 0, poses_);
    for (const std::string& state : told_) std::printf("TOLD %s\n", state.c_str());
  }

 private:
  static int open_bus(const std::string& name) {
    const int bus = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = static_cast<int>(if_nametoindex(name.c_str()));
    if (bus < 0 || bind(bus, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) refuse("no bus " + name);
    return bus;
  }
  static int open_stranger() {
    const int udp = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in from = address_of(kStranger, 0);
    if (udp < 0 || bind(udp, reinterpret_cast<sockaddr*>(&from), sizeof from) != 0) refuse("cannot send as a stranger");
    return udp;
  }
  static sockaddr_in address_of(std::uint32_t host, int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(host);
    return address;
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
      const std::string state(text.data(), static_cast<std::size_t>(n));
      if (told_.size() < told_.capacity()) told_.push_back(state);
    }
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
  void take(std::size_t n, const hal::CanDrive& drive, const can_frame& frame) {
    hal::MitBytes bytes{};
    std::memcpy(bytes.data(), frame.data, bytes.size());
    JointSetpoint command;
    hal::MitReply reply;
    if (hal::try_decode_command(bytes, drive.ranges, command)) {
      ++commands_;
      // Without gains a joint stays where it is: something else holds the robot.
      if (command.kp_nmprad > 0.0) {
        has_gains_ = true;
        q_rad_[static_cast<Eigen::Index>(n)] = command.q_rad;
        reply.t_nm = command.tau_ff_nm;
      }
    } else {
      enters_ += bytes == hal::special_frame(hal::MitSpecial::kEnter) ? 1 : 0;
      exits_ += bytes == hal::special_frame(hal::MitSpecial::kExit) ? 1 : 0;
    }
    if (n == 0) sense();
    const double since_s = 1e-9 * static_cast<double>(monotonic_ns() - begin_ns_);
    if (n == options_.mute || (n == options_.unplugged && since_s >= options_.unplugged_s)) return;
    reply.p_rad = q_rad_[static_cast<Eigen::Index>(n)];
    reply.status = drive.reply == hal::MitReplyRule::kStatusNibble ? 1 : 0;
    send(drive.bus, drive.reply_id, hal::reply_frame(reply, drive.id, drive.ranges, drive.reply));
  }
  // Once a cycle.
  void sense() {
    const hal::CanFeet& feet = bus_.table.feet;
    if (feet.present) send(feet.bus, feet.id, hal::feet_frame({kHalfWeight_n, kHalfWeight_n}, feet.unit_n));
    ++cycles_;
    if (stranger_ >= 0 && cycles_ % kCyclesPerPose == 0) send_pose();
    // A clock of its own, and a Mid-360's rate, as the package has it.
    if (monotonic_ns() - begin_ns_ < imu_due_ns_) return;
    codec::LivoxImuPacket packet;
    packet.udp_count = ++imu_count_;
    packet.stamp_ns = imu_due_ns_ + kNsPerS;
    imu_due_ns_ += 5 * kNsPerMs;
    packet.accel_mps2 = {0.0F, 0.0F, codec::kStandardGravity_mps2};
    std::array<std::uint8_t, codec::kLivoxImuPacket_bytes> bytes{};
    codec::encode(packet, bytes);
    send_datagram(udp_, bytes, options_.imu_port);
  }
  void send_pose() {
    codec::LioPacket packet;
    packet.sequence = poses_++;
    packet.stamp_ns = monotonic_ns();
    packet.position_sigma_m = packet.rotation_sigma_rad = {0.01, 0.01, 0.01};
    std::array<std::uint8_t, codec::kLioPacket_bytes> bytes{};
    codec::encode(packet, bytes);
    send_datagram(stranger_, bytes, options_.stranger_port);
  }
  static void send_datagram(int udp, std::span<const std::uint8_t> bytes, int port) {
    const sockaddr_in to = address_of(INADDR_LOOPBACK, port);
    (void)sendto(udp, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
  template <std::size_t Bytes>
  void send(std::size_t bus, std::uint32_t id, const std::array<std::uint8_t, Bytes>& bytes) {
    can_frame frame{};
    frame.can_id = id;
    frame.len = Bytes;
    std::memcpy(frame.data, bytes.data(), Bytes);
    (void)write(sockets_[bus].fd, &frame, sizeof frame);
  }

  const Options& options_;
  const config::BusFile bus_;
  std::vector<pollfd> sockets_;  // the buses', then the service manager's
  int udp_ = -1, stranger_ = -1;
  std::int64_t begin_ns_ = 0;
  JointVector q_rad_ = JointVector::Zero();
  std::uint16_t imu_count_ = 0;
  std::int64_t imu_due_ns_ = 0;
  unsigned cycles_ = 0;
  std::uint32_t poses_ = 0;
  std::size_t commands_ = 0, enters_ = 0, exits_ = 0;
  bool has_gains_ = false;
  std::vector<std::string> told_;
};

[[noreturn]] void run_as_nobody(char** words) {
  constexpr uid_t kNobody = 65534;
  if (setgroups(0, nullptr) != 0 || setresgid(kNobody, kNobody, kNobody) != 0 ||
      setresuid(kNobody, kNobody, kNobody) != 0)
    refuse("cannot become nobody");
  execv(words[0], words);
  refuse(std::string("cannot start ") + words[0]);
}

int make_black(const char* path) {
  const int device = open(path, O_RDWR | O_CLOEXEC);
  if (device < 0) refuse(std::string("cannot open ") + path);
  constexpr std::array<std::pair<const char*, int>, 2> kControls{{{"Test Pattern", 5}, {"OSD Text Mode", 2}}};
  for (const auto& [name, value] : kControls) {
    v4l2_queryctrl query{};
    query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    bool set = false;
    while (!set && ioctl(device, VIDIOC_QUERYCTRL, &query) == 0) {
      v4l2_control control{.id = query.id, .value = value};
      set = std::strcmp(reinterpret_cast<const char*>(query.name), name) == 0 &&
            ioctl(device, VIDIOC_S_CTRL, &control) == 0;
      query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    if (!set) refuse(std::string("no control ") + name);
  }
  close(device);
  return 0;
}

Options parse(int argc, char** argv) {
  Options options;
  if (argc < 2 || argc % 2 != 0)
    refuse("usage: BUS_FILE [--imu PORT] [--stranger PORT] [--mute DRIVE] [--unplug DRIVE@S] [--notify NAME]");
  options.bus_file = argv[1];
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string_view key = argv[i];
    char* end = nullptr;
    if (key == "--imu") {
      options.imu_port = std::atoi(argv[i + 1]);
    } else if (key == "--stranger") {
      options.stranger_port = std::atoi(argv[i + 1]);
    } else if (key == "--mute") {
      options.mute = std::strtoul(argv[i + 1], nullptr, 10);
    } else if (key == "--unplug") {
      options.unplugged = std::strtoul(argv[i + 1], &end, 10);
      if (*end != '@') refuse("--unplug takes DRIVE@S");
      options.unplugged_s = std::strtod(end + 1, nullptr);
    } else if (key == "--notify") {
      options.notify = argv[i + 1];
    } else {
      refuse("unknown option " + std::string(key));
    }
  }
  return options;
}

int run(const Options& options) {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) refuse("cannot lock its memory");
  // Below both lanes: it answers when they have done their cycle.
  const sched_param scheduling{.sched_priority = 60};
  if (sched_setscheduler(0, SCHED_FIFO, &scheduling) != 0) refuse("cannot have a real-time priority");
  for (const int number : {SIGTERM, SIGINT}) signal(number, [](int) { ended = 1; });
  StandingRobot robot(options);
  std::printf("ROBOT ready\n");
  std::fflush(stdout);
  robot.run();
  robot.print();
  return 0;
}

}  // namespace
}  // namespace polygmap::vm

int main(int argc, char** argv) {
  using namespace polygmap::vm;
  if (argc > 2 && std::string_view(argv[1]) == "--as-nobody") run_as_nobody(argv + 2);
  if (argc == 3 && std::string_view(argv[1]) == "--black") return make_black(argv[2]);
  return run(parse(argc, argv));
}
