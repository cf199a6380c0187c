// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/socket_can.hpp"

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace polygmap::hal {
namespace {

// A data frame's bytes that CAN FD has.
[[nodiscard]] constexpr bool is_fd_length(std::uint8_t length) noexcept {
  return length <= 8 || length == 12 || length == 16 || length == 20 || length == 24 || length == 32 || length == 48 ||
         length == 64;
}

[[nodiscard]] constexpr bool is_id(std::uint32_t id, bool extended) noexcept {
  return id <= (extended ? CAN_EFF_MASK : CAN_SFF_MASK);
}

}  // namespace

SocketCan::SocketCan(const SystemCalls& calls) noexcept : calls_(calls) {
  for (Batch* batch : {&in_, &out_}) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      batch->vectors[i] = {&batch->frames[i], sizeof(canfd_frame)};
      batch->messages[i].msg_hdr.msg_iov = &batch->vectors[i];
      batch->messages[i].msg_hdr.msg_iovlen = 1;
    }
  }
  for (std::size_t i = 0; i < kBatch; ++i) in_.messages[i].msg_hdr.msg_control = in_.control[i].data();
  prepare_read(kBatch);
}

DeviceError SocketCan::open(const Config& config) noexcept {
  close();
  config_ = config;
  const char* name = config_.interface.c_str();
  if (config_.interface.empty() || config_.interface.too_long()) {
    return device_error(DeviceErrorKind::kConfiguration, "CAN", "an interface's name has 1 to 15 characters");
  }
  for (const CanId& id : config_.receive) {
    if (!is_id(id.id, id.extended)) {
      return device_error(DeviceErrorKind::kConfiguration, name, "0x%X is no %s id", id.id,
                          id.extended ? "29 bit" : "11 bit");
    }
  }
  DeviceError error = open_socket();
  if (!error.failed()) owner_.set_open();
  return error;
}

void SocketCan::close() noexcept {
  owner_.set_closed();
  socket_.close();
}

void SocketCan::maintain() noexcept {
  if (!owner_.is_lost()) return;
  socket_.close();
  if (open_socket().failed()) {
    reopens_.failed.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  reopens_.reopened.fetch_add(1, std::memory_order_relaxed);
  owner_.set_open();
}

DeviceError SocketCan::open_socket() noexcept {
  const char* name = config_.interface.c_str();
  Descriptor socket(calls_, calls_.socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW));
  if (!socket.valid()) return system_error(name, "cannot make a CAN socket", errno);
  ifreq request{};
  std::memcpy(static_cast<char*>(request.ifr_name), name, config_.interface.view().size());
  if (calls_.ioctl(socket.get(), SIOCGIFINDEX, &request) != 0) return system_error(name, "no such interface", errno);
  const int index = request.ifr_ifindex;
  if (calls_.ioctl(socket.get(), SIOCGIFFLAGS, &request) != 0)
    return system_error(name, "cannot read its state", errno);
  if ((request.ifr_flags & IFF_UP) == 0) {
    return device_error(DeviceErrorKind::kUnsuitable, name, "the interface is down: ip link set %s up", name);
  }
  if (config_.fd) {
    if (calls_.ioctl(socket.get(), SIOCGIFMTU, &request) != 0) return system_error(name, "cannot read its MTU", errno);
    if (request.ifr_mtu < static_cast<int>(CANFD_MTU)) {
      return device_error(DeviceErrorKind::kUnsuitable, name, "its MTU of %d takes no CAN FD frames", request.ifr_mtu);
    }
  }
  DeviceError error = set_socket(socket.get());
  if (error.failed()) return error;
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (calls_.bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return system_error(name, "cannot bind the socket", errno);
  }
  dropped_ = 0;
  was_down_ = false;
  socket_ = std::move(socket);
  return {};
}

DeviceError SocketCan::set_socket(int fd) noexcept {
  const char* name = config_.interface.c_str();
  if (!config_.receive.empty()) {
    std::array<can_filter, kMostIds> filters{};
    for (std::size_t i = 0; i < config_.receive.size(); ++i) {
      const CanId& id = config_.receive[i];
      filters[i].can_id = id.id | (id.extended ? CAN_EFF_FLAG : 0U);
      filters[i].can_mask = (id.extended ? CAN_EFF_MASK : CAN_SFF_MASK) | CAN_EFF_FLAG | CAN_RTR_FLAG;
    }
    const auto size = static_cast<socklen_t>(config_.receive.size() * sizeof(can_filter));
    if (calls_.setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(), size) != 0) {
      return system_error(name, "cannot set the filter of ids", errno);
    }
  }
  const can_err_mask_t errors = CAN_ERR_MASK;
  if (calls_.setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof(errors)) != 0) {
    return system_error(name, "cannot ask for error frames", errno);
  }
  const int on = 1;
  if (config_.fd && calls_.setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof(on)) != 0) {
    return system_error(name, "cannot ask for CAN FD frames", errno);
  }
  // Without these frames have no stamp, and what the kernel drops is not counted.
  static_cast<void>(calls_.setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof(on)));
  static_cast<void>(calls_.setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof(on)));
  return {};
}

SocketCan::After SocketCan::failed(int error_number, int& attempts) noexcept {
  switch (error_number) {
    case EINTR:
      count_up(counters_.interrupted);
      return attempts++ < kInterruptedRetries ? After::kRetry : After::kStop;
    case EAGAIN:
      return After::kStop;
    case ENETDOWN:  // the socket stays good: frames flow again when the interface is up
      count_up(counters_.interface_down);
      count_up(status_.failed_calls);
      status_.bus_off = status_.error_passive = false;  // it comes up with a controller started anew
      was_down_ = true;
      return After::kStop;
    case ENODEV:
    case ENXIO:
    case EBADF:
      count_up(counters_.interface_gone);
      count_up(status_.failed_calls);
      status_.bus_off = status_.error_passive = false;  // of the next one the controller will tell
      owner_.set_lost();                                // the last that the lane does to the device
      return After::kStop;
    default:
      count_up(status_.failed_calls);
      return After::kStop;
  }
}

// What the kernel wrote into the messages that arrived; it writes into no other.
void SocketCan::prepare_read(std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    in_.messages[i].msg_hdr.msg_controllen = in_.control[i].size();
    in_.messages[i].msg_hdr.msg_flags = 0;
    in_.messages[i].msg_len = 0;
  }
}

std::size_t SocketCan::read(std::span<CanFrame> frames) noexcept {
  std::size_t taken = 0;
  int attempts = 0;
  while (taken < frames.size() && owner_.is_open()) {
    const std::size_t room = std::min(kBatch, frames.size() - taken);
    const int count = calls_.recvmmsg(socket_.get(), in_.messages.data(), static_cast<unsigned>(room), MSG_DONTWAIT);
    if (count < 0) {
      const int error_number = errno;
      if (failed(error_number, attempts) == After::kRetry) continue;
      if (error_number == EAGAIN) was_down_ = false;
      break;
    }
    if (count == 0) break;
    const ClockReading now = read_clocks(calls_);
    const std::size_t arrived = std::min(static_cast<std::size_t>(count), room);
    bool refused_one = false;
    for (std::size_t i = 0; i < arrived; ++i) {
      if (convert(i, now, frames[taken])) {
        ++taken;
      } else {
        refused_one = true;
      }
    }
    prepare_read(arrived);
    if (arrived < room) was_down_ = false;
    // Frames that are refused do not count for the span: a flood of them must not hold the lane.
    if (arrived < room || refused_one) break;
  }
  return taken;
}

bool SocketCan::convert(std::size_t i, const ClockReading& now, CanFrame& frame) noexcept {
  const canfd_frame& raw = in_.frames[i];
  const msghdr& header = in_.messages[i].msg_hdr;
  frame.stamp_ns = 0;
  read_control(header, now, frame);
  const std::size_t size = in_.messages[i].msg_len;
  frame.fd = size == CANFD_MTU;
  const bool whole = (size == CAN_MTU || frame.fd) && (header.msg_flags & MSG_TRUNC) == 0;
  if (!whole || raw.len > (frame.fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN)) {
    count_up(counters_.wrong_size);
    return false;
  }
  frame.error = (raw.can_id & CAN_ERR_FLAG) != 0;
  frame.extended = !frame.error && (raw.can_id & CAN_EFF_FLAG) != 0;
  if (!frame.error && (raw.can_id & CAN_RTR_FLAG) != 0) {
    count_up(counters_.remote_frames);
    return false;
  }
  frame.id = raw.can_id & (frame.error || frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.length = raw.len;
  std::copy_n(static_cast<const std::uint8_t*>(raw.data), raw.len, frame.data.begin());
  if (frame.error) {
    note_error(raw);
  } else {
    count_up(status_.received);
  }
  return true;
}

void SocketCan::read_control(const msghdr& header, const ClockReading& now, CanFrame& frame) noexcept {
  // The macros want a header that may be written.
  msghdr walk = header;
  for (cmsghdr* c = CMSG_FIRSTHDR(&walk); c != nullptr; c = CMSG_NXTHDR(&walk, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMPNS && c->cmsg_len >= CMSG_LEN(sizeof(timespec)) && now.good) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(c), sizeof(stamp));
      frame.stamp_ns = now.to_monotonic_ns(stamp.tv_sec * kNsPerS + stamp.tv_nsec);
    } else if (c->cmsg_type == SO_RXQ_OVFL && c->cmsg_len >= CMSG_LEN(sizeof(std::uint32_t))) {
      std::uint32_t dropped = 0;
      std::memcpy(&dropped, CMSG_DATA(c), sizeof(dropped));
      count_up(status_.lost, dropped - dropped_);  // modulo 2^32
      dropped_ = dropped;
    }
  }
}

void SocketCan::note_error(const canfd_frame& frame) noexcept {
  count_up(status_.error_frames);
  if (was_down_) return;  // the kernel tells of the interface before it gives the frames from before
  if ((frame.can_id & CAN_ERR_BUSOFF) != 0) status_.bus_off = true;
  if ((frame.can_id & CAN_ERR_RESTARTED) != 0) status_.bus_off = status_.error_passive = false;
  if ((frame.can_id & CAN_ERR_CRTL) != 0 && frame.len > 1) {
    const unsigned state = frame.data[1];
    constexpr unsigned kPassive = CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE;
    constexpr unsigned kBetter = CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING | CAN_ERR_CRTL_ACTIVE;
    if ((state & kPassive) != 0) {
      status_.error_passive = true;
    } else if ((state & kBetter) != 0) {
      status_.error_passive = false;
    }
  }
}

bool SocketCan::prepare_write(std::size_t i, const CanFrame& frame) noexcept {
  const bool fits = frame.fd ? config_.fd && is_fd_length(frame.length) : frame.length <= CAN_MAX_DLEN;
  if (frame.error || !fits || !is_id(frame.id, frame.extended)) return false;
  canfd_frame& raw = out_.frames[i];
  raw.flags = raw.__res0 = raw.__res1 = 0;
  raw.can_id = frame.id | (frame.extended ? CAN_EFF_FLAG : 0U);
  raw.len = frame.length;
  if (frame.fd && config_.bit_rate_switch) raw.flags = CANFD_BRS;
  std::copy_n(frame.data.begin(), frame.length, static_cast<std::uint8_t*>(raw.data));
  out_.vectors[i].iov_len = frame.fd ? CANFD_MTU : CAN_MTU;
  return true;
}

std::size_t SocketCan::write(std::span<const CanFrame> frames) noexcept {
  std::size_t taken = 0;
  int attempts = 0;
  if (!owner_.is_open()) count_up(status_.refused, frames.size());
  while (taken < frames.size() && owner_.is_open()) {
    const std::size_t want = std::min(kBatch, frames.size() - taken);
    std::size_t ready = 0;
    while (ready < want && prepare_write(ready, frames[taken + ready])) ++ready;
    if (ready == 0) {
      count_up(counters_.unsendable);
      break;
    }
    const int count = calls_.sendmmsg(socket_.get(), out_.messages.data(), static_cast<unsigned>(ready), MSG_DONTWAIT);
    if (count > 0) {
      const std::size_t sent = std::min(static_cast<std::size_t>(count), ready);
      taken += sent;
      count_up(status_.sent, sent);
      continue;
    }
    if (count == 0) break;
    if (errno == EAGAIN || errno == ENOBUFS) {
      count_up(status_.refused, frames.size() - taken);
      break;
    }
    if (failed(errno, attempts) == After::kStop) break;
  }
  return taken;
}

}  // namespace polygmap::hal
