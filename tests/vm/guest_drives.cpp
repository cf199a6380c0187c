// SPDX-License-Identifier: Apache-2.0
// guest_drives SCRIPT [--inject WHAT@S]: the drives and sensors of the guest, a process of its own. It answers each
// command on the CAN buses as the script says (wire_script.hpp), compares the command with the one that the host's
// module gave in that tick, and sends the sensors' datagrams. Commands lead: the drives of tick n speak when tick n's
// command has come, so that both processes need no common clock. It ends when the last command has come or none comes
// for two seconds, and prints "DRIVES frames= frames_differ= ...".
//
// Before the first command that the script expects others may come, from a controller that arms its drives: they get
// the first answer, and are not compared. WHAT: unplug=ID (the drive of that index is silent), busoff=BUS (the
// controller tells that it left the bus), garbage=BUS (frames that nobody sends), duplicate=ID (it answers twice),
// gap=MS (nothing is said).
#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>

#include "tests/vm/wire_script.hpp"

namespace polygmap::vm {
namespace {

[[noreturn]] void refuse(const std::string& why) {
  std::fprintf(stderr, "guest_drives: %s\n", why.c_str());
  std::exit(2);
}

enum class Wrong { kNothing, kUnplug, kBusOff, kGarbage, kDuplicate, kGap };
struct Injection {
  Wrong what = Wrong::kNothing;
  long number = 0;  // drive, bus, or milliseconds
  long tick = 0;    // from here on, or (busoff) here
};

Injection parse_injection(const std::string& text) {
  constexpr std::pair<const char*, Wrong> kKinds[] = {{"unplug=", Wrong::kUnplug},
                                                      {"busoff=", Wrong::kBusOff},
                                                      {"garbage=", Wrong::kGarbage},
                                                      {"duplicate=", Wrong::kDuplicate},
                                                      {"gap=", Wrong::kGap}};
  const std::size_t at = text.find('@');
  for (const auto& [name, what] : kKinds) {
    if (!text.starts_with(name) || at == std::string::npos) continue;
    char *number_end = nullptr, *time_end = nullptr;
    Injection injection{what, std::strtol(text.c_str() + std::strlen(name), &number_end, 10), 0};
    const double seconds = std::strtod(text.c_str() + at + 1, &time_end);
    if (number_end != text.c_str() + at || *time_end != '\0' || injection.number < 0 ||
        !(seconds >= 0.0 && seconds < 1e4))
      break;
    injection.tick = static_cast<long>(seconds * 500.0 + 0.5);
    return injection;
  }
  refuse("--inject takes unplug=ID, busoff=BUS, garbage=BUS, duplicate=ID or gap=MS, @ and seconds: " + text);
}

int open_bus(const std::string& name) {
  const int socket_fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(name.c_str()));
  if (socket_fd < 0 || address.can_ifindex == 0) refuse("there is no bus " + name);
  if (bind(socket_fd, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) refuse("cannot bind to " + name);
  return socket_fd;
}

class Drives {
 public:
  Drives(const WireScript& script, const Injection& injection)
      : script_(script), injection_(injection), next_(script.drives.size(), 0), udp_(socket(AF_INET, SOCK_DGRAM, 0)) {
    for (const std::string& bus : script.buses) sockets_.push_back({open_bus(bus), POLLIN, 0});
    const bool of_a_bus = injection.what == Wrong::kBusOff || injection.what == Wrong::kGarbage;
    const std::size_t count = of_a_bus ? script.buses.size() : script.drives.size();
    if (injection.what != Wrong::kGap && static_cast<std::size_t>(injection.number) >= count)
      refuse("--inject names none");
  }

  void run() {
    for (const Datagram& datagram : script_.first) send(datagram);
    // Whoever sends to a socket that is waited for pays for the wake: the module would, four times a cycle. It sends to
    // the last bus last; what comes on others alone is found a little later.
    constexpr int kSilence_ms = 2000, kFirstSilence_ms = 20'000, kPatience_ms = 5;
    for (int silent_ms = 0; !at_end() && silent_ms < (armed_ ? kSilence_ms : kFirstSilence_ms);) {
      poll(&sockets_.back(), 1, kPatience_ms);
      bool heard = false;
      for (std::size_t bus = 0; bus < sockets_.size(); ++bus) heard |= read_bus(static_cast<int>(bus));
      silent_ms = heard ? 0 : silent_ms + kPatience_ms;
    }
  }
  void print() const {
    std::size_t missing = 0;
    for (std::size_t d = 0; d < next_.size(); ++d) missing += script_.drives[d].expected.size() - next_[d];
    std::printf("DRIVES frames=%zu frames_differ=%zu arming=%zu missing=%zu unknown=%zu refused=%zu\n", frames_,
                differ_, arming_, missing, unknown_, refused_);
    if (!first_difference_.empty()) std::printf("DRIVES first difference: %s\n", first_difference_.c_str());
  }
  [[nodiscard]] bool all_equal() const noexcept { return frames_ > 0 && differ_ == 0 && at_end(); }

 private:
  [[nodiscard]] bool at_end() const noexcept {
    for (std::size_t d = 0; d < next_.size(); ++d) {
      if (next_[d] < script_.drives[d].expected.size()) return false;
    }
    return true;
  }

  // Whether anything had come.
  bool read_bus(int bus) {
    bool heard = false;
    can_frame frame{};
    while (read(sockets_[static_cast<std::size_t>(bus)].fd, &frame, sizeof frame) == sizeof frame) {
      take(bus, frame);
      heard = true;
    }
    return heard;
  }
  void take(int bus, const can_frame& frame) {
    for (std::size_t d = 0; d < script_.drives.size(); ++d) {
      if (script_.drives[d].bus == bus && script_.drives[d].id == frame.can_id) return take_command(d, frame);
    }
    ++unknown_;
  }
  static bool same(const can_frame& a, const can_frame& b) noexcept {
    return a.can_id == b.can_id && a.len == b.len && std::memcmp(a.data, b.data, a.len) == 0;
  }
  void take_command(std::size_t d, const can_frame& frame) {
    const Drive& drive = script_.drives[d];
    const bool equal = next_[d] < drive.expected.size() && same(frame, drive.expected[next_[d]]);
    if (!armed_ && !equal) {
      ++arming_;
      answer(d, drive.answers.front());
      return;
    }
    armed_ = true;
    ++frames_;
    if (next_[d] >= drive.expected.size()) return static_cast<void>(++differ_);
    if (!equal) note_difference(d, frame);
    if (static_cast<long>(next_[d]) > tick_) begin_tick(static_cast<long>(next_[d]));
    answer(d, drive.answers[next_[d]++]);
    const bool complete = std::ranges::all_of(next_, [this](std::size_t n) { return static_cast<long>(n) > tick_; });
    if (complete) send_datagrams();
  }
  void note_difference(std::size_t d, const can_frame& frame) {
    ++differ_;
    if (!first_difference_.empty()) return;
    first_difference_ = "tick " + std::to_string(next_[d]) + ", drive " + std::to_string(d) + ", ";
    std::array<char, 3> digits{};
    for (int i = 0; i < frame.len; ++i) {
      std::snprintf(digits.data(), digits.size(), "%02X", frame.data[i]);
      first_difference_ += digits.data();
    }
  }

  // Of a tick whose commands did not all come the datagrams are sent late, not never.
  void begin_tick(long tick) {
    if (tick_ >= 0 && datagrams_sent_ < tick_) send_datagrams();
    tick_ = tick;
    inject();
    if (in_gap()) return;
    for (const auto& [bus, frame] : script_.ticks[static_cast<std::size_t>(tick)].said) send(bus, frame);
  }
  [[nodiscard]] bool in_gap() const noexcept {
    return injection_.what == Wrong::kGap && tick_ >= injection_.tick &&
           tick_ < injection_.tick + injection_.number / 2;
  }
  void inject() {
    if (tick_ < injection_.tick) return;
    const int bus = static_cast<int>(injection_.number);
    if (injection_.what == Wrong::kBusOff && tick_ == injection_.tick) {
      can_frame off{};
      off.can_id = CAN_ERR_FLAG | CAN_ERR_BUSOFF;
      off.len = CAN_ERR_DLC;
      send(bus, off);
    }
    if (injection_.what != Wrong::kGarbage) return;
    for (int i = 0; i < 4; ++i) {  // any identifier, any length, any bytes
      seed_ = seed_ * 6364136223846793005U + 1442695040888963407U;
      can_frame frame{};
      frame.can_id = static_cast<canid_t>(seed_ >> 53U) & CAN_SFF_MASK;
      const bool is_command =
          std::ranges::any_of(script_.drives, [&](const Drive& d) { return d.bus == bus && d.id == frame.can_id; });
      if (is_command) continue;
      frame.len = static_cast<__u8>((seed_ >> 40U) % 9);
      std::memcpy(frame.data, &seed_, sizeof seed_);
      send(bus, frame);
    }
  }
  void answer(std::size_t d, const can_frame& frame) {
    const bool meant = injection_.number == static_cast<long>(d) && tick_ >= injection_.tick && armed_;
    if (in_gap() || (meant && injection_.what == Wrong::kUnplug)) return;
    send(script_.drives[d].bus, frame);
    if (meant && injection_.what == Wrong::kDuplicate) send(script_.drives[d].bus, frame);
  }
  void send_datagrams() {
    datagrams_sent_ = tick_ + 1;
    if (in_gap()) return;
    for (const Datagram& datagram : script_.ticks[static_cast<std::size_t>(tick_)].datagrams) send(datagram);
  }
  void send(int bus, const can_frame& frame) {
    if (bus >= static_cast<int>(sockets_.size())) refuse("there is no bus " + std::to_string(bus));
    if (write(sockets_[static_cast<std::size_t>(bus)].fd, &frame, sizeof frame) != sizeof frame) ++refused_;
  }
  void send(const Datagram& datagram) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(datagram.port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const auto sent =
        sendto(udp_, datagram.bytes.data(), datagram.bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to);
    if (sent != static_cast<ssize_t>(datagram.bytes.size())) ++refused_;
  }

  const WireScript& script_;
  const Injection injection_;
  std::vector<pollfd> sockets_;
  std::vector<std::size_t> next_;  // of each drive: the tick whose command comes next
  int udp_;
  long tick_ = -1, datagrams_sent_ = 0;
  bool armed_ = false;
  std::size_t frames_ = 0, differ_ = 0, arming_ = 0, unknown_ = 0, refused_ = 0;
  std::uint64_t seed_ = 1;
  std::string first_difference_;
};

int run(const std::string& path, const Injection& injection) {
  WireScript script;
  if (const std::string wrong = script.read(path); !wrong.empty()) refuse(wrong);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) refuse("cannot lock its memory");
  // Below both lanes of the module: its drives answer when it has done its cycle.
  const sched_param scheduling{.sched_priority = 60};
  if (sched_setscheduler(0, SCHED_FIFO, &scheduling) != 0) refuse("cannot have a real-time priority");
  Drives drives(script, injection);
  std::printf("DRIVES ready: %zu drives on %zu buses, %zu ticks\n", script.drives.size(), script.buses.size(),
              script.ticks.size());
  std::fflush(stdout);
  drives.run();
  drives.print();
  return drives.all_equal() ? 0 : 1;
}

}  // namespace
}  // namespace polygmap::vm

int main(int argc, char** argv) {
  using namespace polygmap::vm;
  const bool injects = argc == 4 && std::string_view(argv[2]) == "--inject";
  if (argc != 2 && !injects) refuse("usage: guest_drives SCRIPT [--inject WHAT@S]");
  return run(argv[1], injects ? parse_injection(argv[3]) : Injection{});
}
