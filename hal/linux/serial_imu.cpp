// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/serial_imu.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>

#include <cerrno>

namespace polygmap::hal {
namespace {

struct Speed {
  std::uint32_t baud;
  speed_t code;
};
constexpr std::array<Speed, 11> kSpeeds{{{9'600, B9600},
                                         {19'200, B19200},
                                         {38'400, B38400},
                                         {57'600, B57600},
                                         {115'200, B115200},
                                         {230'400, B230400},
                                         {460'800, B460800},
                                         {921'600, B921600},
                                         {1'000'000, B1000000},
                                         {2'000'000, B2000000},
                                         {3'000'000, B3000000}}};

// B0, which hangs up, for a rate that is none of the kernel's.
[[nodiscard]] speed_t code_of(std::uint32_t baud) noexcept {
  for (const Speed& speed : kSpeeds) {
    if (speed.baud == baud) return speed.code;
  }
  return B0;
}

}  // namespace

DeviceError SerialImu::open(const Config& config) noexcept {
  close();
  config_ = config;
  const char* name = config_.device.c_str();
  if (config_.device.empty() || config_.device.too_long()) {
    return device_error(DeviceErrorKind::kConfiguration, "serial IMU", "a device's path has 1 to 63 characters");
  }
  if (code_of(config_.baud) == B0) {
    return device_error(DeviceErrorKind::kConfiguration, name, "%u baud is none of the kernel's rates", config_.baud);
  }
  finder_.restart();
  last_stamp_ns_ = INT64_MIN;
  waiting_.clear();
  DeviceError error = open_line();
  if (!error.failed()) owner_.set_open();
  return error;
}

void SerialImu::close() noexcept {
  owner_.set_closed();
  line_.close();
}

void SerialImu::maintain() noexcept {
  if (!owner_.is_lost()) return;
  line_.close();
  if (open_line().failed()) {
    reopens_.failed.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  reopens_.reopened.fetch_add(1, std::memory_order_relaxed);
  owner_.set_open();
}

DeviceError SerialImu::open_line() noexcept {
  const char* name = config_.device.c_str();
  // Neither may the line become this process's terminal nor may a modem's missing carrier hold the call.
  Descriptor line(calls_, calls_.open(name, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!line.valid()) return system_error(name, "cannot open", errno);
  DeviceError error = set_line(line.get());
  if (error.failed()) return error;
  // What arrived before has an unknown age. Nobody else reads the line's bytes from here on.
  static_cast<void>(calls_.ioctl(line.get(), TCFLSH, reinterpret_cast<void*>(static_cast<std::intptr_t>(TCIFLUSH))));
  static_cast<void>(calls_.ioctl(line.get(), TIOCEXCL, nullptr));
  clock_ = SampleClock(config_.time);
  watch_ = SequenceWatch(config_.sequence);
  line_ = std::move(line);
  return {};
}

DeviceError SerialImu::set_line(int fd) noexcept {
  const char* name = config_.device.c_str();
  termios settings{};
  if (calls_.tcgetattr(fd, &settings) != 0) return system_error(name, "is no serial line", errno);
  ::cfmakeraw(&settings);
  const speed_t code = code_of(config_.baud);
  ::cfsetispeed(&settings, code);
  ::cfsetospeed(&settings, code);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  // With VMIN of 0 a line that hung up could not be told from one that is silent.
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (calls_.tcsetattr(fd, TCSANOW, &settings) != 0) return system_error(name, "cannot set up the line", errno);
  termios taken{};  // tcsetattr is content when it could do any of it
  if (calls_.tcgetattr(fd, &taken) != 0) return system_error(name, "cannot read the line's settings", errno);
  if (::cfgetispeed(&taken) != code || (taken.c_lflag & ICANON) != 0) {
    return device_error(DeviceErrorKind::kUnsuitable, name, "does not take %u baud", config_.baud);
  }
  return {};
}

bool SerialImu::try_read(ImuSample& sample) noexcept {
  // All that has arrived, so that the newest push out the oldest here: the kernel, once full, drops the newest.
  bool more = waiting_.empty();
  for (int i = 0; i < kMostReads && more && owner_.is_open(); ++i) more = read_some();
  return waiting_.try_pop(sample);
}

void SerialImu::lose() noexcept {
  finder_.restart();
  owner_.set_lost();  // the last that the lane does to the device
}

bool SerialImu::read_some() noexcept {
  ssize_t size = -1;
  for (int attempt = 0; size < 0 && attempt <= kInterruptedRetries; ++attempt) {
    size = calls_.read(line_.get(), bytes_.data(), bytes_.size());
    if (size >= 0) break;
    if (errno == EINTR) {
      count_up(counters_.interrupted);
      continue;
    }
    if (errno == EAGAIN || errno == EWOULDBLOCK) return false;
    count_up(errno == EIO ? counters_.hang_ups : counters_.failed_calls);
    lose();
    return false;
  }
  if (size < 0) return false;
  if (size == 0) {
    count_up(counters_.hang_ups);
    lose();
    return false;
  }
  const ClockReading now = read_clocks(calls_);
  if (!now.good) {  // samples of unknown age are none
    count_up(counters_.failed_calls);
    finder_.restart();
    return true;
  }
  const auto count = std::min(static_cast<std::size_t>(size), bytes_.size());
  for (std::size_t i = 0; i < count; ++i) {
    codec::ImuFrame frame;
    if (finder_.push(bytes_[i], frame)) take(frame, now.monotonic_ns);
  }
  return count == bytes_.size();
}

void SerialImu::take(const codec::ImuFrame& frame, std::int64_t arrival_ns) noexcept {
  ImuSample sample;
  const std::uint32_t restarts = counters_.sequence.restarts;
  if (!watch_.takes(frame.sequence, counters_.sequence)) return;
  if (counters_.sequence.restarts != restarts) clock_.restart();  // the sender's clock began anew, too
  if (!clock_.timely(frame.stamp_ns, arrival_ns, sample.stamp_ns, counters_.time)) return;
  if (sample.stamp_ns <= last_stamp_ns_) {
    count_up(counters_.sequence.out_of_order);
    return;
  }
  last_stamp_ns_ = sample.stamp_ns;
  const auto in_base = [this](const std::array<float, 3>& x) noexcept -> Vec3 {
    return config_.base_R_imu * Vec3(double{x[0]}, double{x[1]}, double{x[2]});
  };
  sample.gyro_radps = in_base(frame.gyro_radps);
  sample.accel_mps2 = in_base(frame.accel_mps2);
  count_up(counters_.good);
  if (waiting_.full()) count_up(counters_.overwritten);
  waiting_.push_overwrite(sample);
}

}  // namespace polygmap::hal
