// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/doctor/can_link.hpp"

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <span>

namespace polygmap::daemon {
namespace {

using Bytes = std::span<const unsigned char>;

// Calls take(type, payload) for each attribute.
template <typename Take>
void for_each_attribute(Bytes bytes, Take&& take) {
  while (bytes.size() >= sizeof(rtattr)) {
    rtattr head{};
    std::memcpy(&head, bytes.data(), sizeof head);
    if (head.rta_len < sizeof head || head.rta_len > bytes.size()) return;
    take(head.rta_type & NLA_TYPE_MASK, bytes.subspan(RTA_LENGTH(0), head.rta_len - RTA_LENGTH(0)));
    const std::size_t whole = RTA_ALIGN(head.rta_len);
    bytes = whole < bytes.size() ? bytes.subspan(whole) : Bytes{};
  }
}
template <typename T>
bool copy(Bytes from, T& to) {
  if (from.size() < sizeof to) return false;
  std::memcpy(&to, from.data(), sizeof to);
  return true;
}

CanLink link_of(Bytes info) {
  CanLink link;
  for_each_attribute(info, [&link](int type, Bytes value) {
    if (type != IFLA_INFO_DATA) return;
    for_each_attribute(value, [&link](int kind, Bytes data) {
      std::uint32_t number = 0;
      can_bittiming timing{};
      if (kind == IFLA_CAN_STATE && copy(data, number) && number <= CAN_STATE_SLEEPING) {
        link.state = static_cast<CanLink::State>(number);
      }
      if (kind == IFLA_CAN_RESTART_MS && copy(data, number)) link.restart_ms = number;
      if (kind == IFLA_CAN_BITTIMING && copy(data, timing)) link.bitrate_bps = timing.bitrate;
    });
  });
  return link;
}

}  // namespace

std::string_view name_of(CanLink::State state) noexcept {
  constexpr std::array<std::string_view, 6> kNames{"error-active", "error-warning", "error-passive",
                                                   "bus-off",      "stopped",       "sleeping"};
  return kNames[static_cast<std::size_t>(state)];
}

std::optional<CanLink> ask_can_link(const std::string& interface) {
  struct {
    nlmsghdr head;
    ifinfomsg link;
  } question{};
  question.head = {.nlmsg_len = sizeof question,
                   .nlmsg_type = RTM_GETLINK,
                   .nlmsg_flags = NLM_F_REQUEST,
                   .nlmsg_seq = 1,
                   .nlmsg_pid = 0};
  question.link.ifi_index = static_cast<int>(::if_nametoindex(interface.c_str()));
  const int socket = question.link.ifi_index == 0 ? -1 : ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (socket < 0) return std::nullopt;
  constexpr timeval kPatience{1, 0};
  ::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  alignas(nlmsghdr) std::array<unsigned char, 16384> answer{};
  const bool asked = ::send(socket, &question, sizeof question, 0) == static_cast<ssize_t>(sizeof question);
  const ssize_t got = asked ? ::recv(socket, answer.data(), answer.size(), 0) : -1;
  ::close(socket);
  nlmsghdr head{};
  constexpr std::size_t kBefore = NLMSG_LENGTH(sizeof(ifinfomsg));
  if (got < static_cast<ssize_t>(kBefore) || !copy(Bytes(answer), head) || head.nlmsg_type != RTM_NEWLINK) {
    return std::nullopt;
  }
  CanLink link;
  for_each_attribute(Bytes(answer).subspan(kBefore, static_cast<std::size_t>(got) - kBefore),
                     [&link](int type, Bytes value) {
                       if (type == IFLA_LINKINFO) link = link_of(value);
                     });
  return link;
}

}  // namespace polygmap::daemon
