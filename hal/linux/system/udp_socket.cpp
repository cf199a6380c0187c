// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/system/udp_socket.hpp"

#include <arpa/inet.h>
#include <linux/filter.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace polygmap::hal {
namespace {

// False: no IPv4 address. Empty is 0, any.
[[nodiscard]] bool parse(const FixedText<15>& text, in_addr_t& address) noexcept {
  in_addr read{};
  if (text.too_long() || (!text.empty() && ::inet_pton(AF_INET, text.c_str(), &read) != 1)) return false;
  address = read.s_addr;
  return true;
}

}  // namespace

DeviceError UdpSocket::open(const UdpConfig& config, const SystemCalls& calls) noexcept {
  close();
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "UDP port %u", unsigned{config.port});
  if (config.port == 0) return device_error(DeviceErrorKind::kConfiguration, name.data(), "a port is 1 to 65535");
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(config.port);
  if (!parse(config.address, own.sin_addr.s_addr) || !parse(config.sender, sender_)) {
    const bool of_sender = parse(config.address, own.sin_addr.s_addr);
    return device_error(DeviceErrorKind::kConfiguration, name.data(), "the %s '%s' is not an IPv4 address",
                        of_sender ? "sender" : "address", of_sender ? config.sender.c_str() : config.address.c_str());
  }
  calls_ = &calls;
  Descriptor socket(calls, calls.socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket.valid()) return system_error(name.data(), "cannot make a socket", errno);
  // Without these the time of reading is the time of arrival, and what the kernel drops is not counted.
  const int on = 1;
  static_cast<void>(calls.setsockopt(socket.get(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof(on)));
  static_cast<void>(calls.setsockopt(socket.get(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof(on)));
  if (sender_ != 0) keep_others_out(socket.get());  // before the first one can come
  if (calls.bind(socket.get(), reinterpret_cast<const sockaddr*>(&own), sizeof(own)) != 0) {
    return system_error(name.data(), "cannot listen", errno);
  }
  dropped_ = 0;
  socket_ = std::move(socket);
  return {};
}

// Where the kernel does not take it, receive() judges by itself. An address is no proof: who forges it passes both.
void UdpSocket::keep_others_out(int fd) const noexcept {
  constexpr std::uint32_t kSourceAddress = static_cast<std::uint32_t>(SKF_NET_OFF) + 12U;  // in an IPv4 header
  constexpr std::uint32_t kAll = 0xFFFF'FFFFU;
  std::array<sock_filter, 4> program{{{BPF_LD | BPF_W | BPF_ABS, 0, 0, kSourceAddress},
                                      {BPF_JMP | BPF_JEQ | BPF_K, 0, 1, ntohl(sender_)},
                                      {BPF_RET | BPF_K, 0, 0, kAll},
                                      {BPF_RET | BPF_K, 0, 0, 0}}};
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  static_cast<void>(calls_->setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof(filter)));
}

void UdpSocket::prepare() noexcept {
  for (std::size_t i = 0; i < kBatch; ++i) {
    Slot& slot = slots_[i];
    slot.vector = {slot.bytes.data(), slot.bytes.size()};
    msghdr& header = messages_[i].msg_hdr;
    header = {};
    header.msg_name = &slot.sender;
    header.msg_namelen = sizeof(slot.sender);
    header.msg_iov = &slot.vector;
    header.msg_iovlen = 1;
    header.msg_control = slot.control.data();
    header.msg_controllen = slot.control.size();
    messages_[i].msg_len = 0;
  }
}

std::span<const Datagram> UdpSocket::receive(bool& more) noexcept {
  prepare();
  int count = -1;
  for (int attempt = 0; count < 0 && attempt <= kInterruptedRetries; ++attempt) {
    count = calls_->recvmmsg(socket_.get(), messages_.data(), kBatch, MSG_DONTWAIT);
    if (count >= 0) break;
    if (errno == EINTR) {
      count_up(counters_.interrupted);
      continue;
    }
    if (errno != EAGAIN && errno != EWOULDBLOCK) count_up(counters_.failed_calls);
    break;
  }
  more = count == static_cast<int>(kBatch);
  if (count <= 0) return {};
  const ClockReading now = read_clocks(*calls_);
  if (!now.good) {  // samples of unknown age are none
    count_up(counters_.failed_calls);
    return {};
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < std::min(static_cast<std::size_t>(count), kBatch); ++i) {
    const msghdr& header = messages_[i].msg_hdr;
    count_up(counters_.datagrams);
    const std::int64_t arrival_ns = arrival_of(header, now);
    const bool named = header.msg_namelen >= sizeof(sockaddr_in) && slots_[i].sender.sin_family == AF_INET;
    if (sender_ != 0 && (!named || slots_[i].sender.sin_addr.s_addr != sender_)) {
      count_up(counters_.foreign_sender);
      continue;
    }
    const std::size_t size = std::min<std::size_t>(messages_[i].msg_len, kMostBytes);
    datagrams_[kept++] = {codec::Bytes(slots_[i].bytes).first(size), arrival_ns};
  }
  return std::span<const Datagram>(datagrams_).first(kept);
}

std::int64_t UdpSocket::arrival_of(const msghdr& header, const ClockReading& now) noexcept {
  std::int64_t arrival_ns = now.monotonic_ns;
  // The macros want a header that may be written.
  msghdr walk = header;
  for (cmsghdr* c = CMSG_FIRSTHDR(&walk); c != nullptr; c = CMSG_NXTHDR(&walk, c)) {
    if (c->cmsg_level != SOL_SOCKET) continue;
    if (c->cmsg_type == SCM_TIMESTAMPNS && c->cmsg_len >= CMSG_LEN(sizeof(timespec))) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(c), sizeof(stamp));
      // It came before now, even where CLOCK_REALTIME was set back since.
      arrival_ns = std::min(arrival_ns, now.to_monotonic_ns(stamp.tv_sec * kNsPerS + stamp.tv_nsec));
    } else if (c->cmsg_type == SO_RXQ_OVFL && c->cmsg_len >= CMSG_LEN(sizeof(std::uint32_t))) {
      std::uint32_t dropped = 0;
      std::memcpy(&dropped, CMSG_DATA(c), sizeof(dropped));
      count_up(counters_.lost, dropped - dropped_);  // modulo 2^32
      dropped_ = dropped;
    }
  }
  return arrival_ns;
}

}  // namespace polygmap::hal
