// SPDX-License-Identifier: Apache-2.0
// Who asks the module to start, pause and stop in a simulated climb.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/supervisor.hpp"
#include "hal/ports/operator_input.hpp"

namespace polygmap::sim {

// Its states as they change, and what it refuses, are said on a stream.
class ClimbOperator : public hal::OperatorInput {
 public:
  // Before each cycle of the module, with the state it is in.
  void look(std::int64_t now_ns, ModuleState state);
  // It may still ask for something: a module that waits, or a gait that has ended, is not the end of the climb.
  [[nodiscard]] virtual bool has_more() const = 0;
  // It wants no more of this climb.
  [[nodiscard]] virtual bool has_left() const { return false; }
  [[nodiscard]] bool try_read(OperatorRequest& request) noexcept final;
  void answer(const OperatorAnswer& answer) noexcept final;

 protected:
  explicit ClimbOperator(std::ostream& out) : out_(out) {}
  ~ClimbOperator() = default;

  [[nodiscard]] std::ostream& out() { return out_; }
  [[nodiscard]] std::optional<ModuleState> state() const { return state_; }  // of the module, before its cycle
  [[nodiscard]] std::int64_t now_ns() const { return now_ns_; }
  virtual void listen() = 0;  // once a cycle, before the module's
  [[nodiscard]] virtual std::optional<OperatorRequest> next() = 0;

 private:
  void say(const std::string& words);

  std::ostream& out_;
  std::int64_t now_ns_ = 0;
  std::optional<ModuleState> state_;
  OperatorCommand asked_{};  // last
};

struct TimedRequest {
  double at_s = 0.0;
  OperatorRequest request;
};

// Each request at its time, simulated.
class ScriptedOperator final : public ClimbOperator {
 public:
  // In the order of their times.
  ScriptedOperator(std::vector<TimedRequest> script, std::ostream& out)
      : ClimbOperator(out), script_(std::move(script)) {}

  [[nodiscard]] bool has_more() const override { return next_ < script_.size(); }

 private:
  void listen() override {}
  [[nodiscard]] std::optional<OperatorRequest> next() override {
    if (next_ >= script_.size() || 1e-9 * static_cast<double>(now_ns()) < script_[next_].at_s) return std::nullopt;
    return script_[next_++].request;
  }

  std::vector<TimedRequest> script_;
  std::size_t next_ = 0;
};

// As in "start@4.5"; a sentence where it is none.
[[nodiscard]] std::string read_request(const std::string& text, TimedRequest& request);

// Arms the robot, sends it to a place as soon as it stands, and back from there where it is told the way.
class Dispatcher final : public ClimbOperator {
 public:
  using WayBack = std::function<Destination()>;  // from where it stands when it is asked
  Dispatcher(const Destination& to, std::ostream& out, WayBack way_back = {})
      : ClimbOperator(out), to_(to), way_back_(std::move(way_back)) {}

  [[nodiscard]] bool has_more() const override {
    return !sent_ || (way_back_ && state() != ModuleState::kSafeStop && state() != ModuleState::kFallen);
  }

 private:
  void listen() override {}
  [[nodiscard]] std::optional<OperatorRequest> next() override;

  Destination to_;
  WayBack way_back_;  // until it was sent
  bool armed_ = false, sent_ = false;
};

}  // namespace polygmap::sim
