// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/climb/climb_verdict.hpp"

#include <cmath>
#include <cstdio>

namespace polygmap::sim {
namespace {

std::string sentence(const char* format, double a = 0.0, double b = 0.0, double c = 0.0, double d = 0.0) {
  char buffer[200];
  std::snprintf(buffer, sizeof buffer, format, a, b, c, d);
  return buffer;
}

// With the rise, drop, tread or slope that was measured, where one is behind the reason.
std::string why_stopped(StopReason reason, double measured_m) {
  const std::string why(text_of(reason));
  if (reason == StopReason::kTooSteep) return why + sentence(" (%.1f degrees)", std::atan(measured_m) * 180.0 / kPi);
  const bool of_a_length = reason == StopReason::kRiseTooHigh || reason == StopReason::kDropTooDeep ||
                           reason == StopReason::kTreadTooShort || reason == StopReason::kLegsCannot;
  return of_a_length && measured_m > 0.0 ? why + sentence(" (%.3f m)", measured_m) : why;
}

// The gait has not ended, and the plant has not fallen.
std::string why_ended_early(const std::string& climbed, const ClimbEnding& ending) {
  const std::string state(name_of(ending.module_state));
  if (ending.operator_end == OperatorEnd::kLeft) {
    return "The operator left after " + climbed + "; the module's state was " + state + ".";
  }
  if (ending.operator_end == OperatorEnd::kAsksNoMore) {
    return "No command was to come after " + climbed + ", and the module waited for one; its state was " + state + ".";
  }
  return "Time ran out after " + climbed + ".";
}

// To a place: to the world's goal where nobody else asks, else by the last who said where to.
bool was_sent(const ClimbOptions& options) {
  if (options.climb_operator == nullptr) return options.world && options.world->world.goal;
  bool sent = false;
  for (const TimedRequest& one : options.asked) {
    const OperatorCommand command = one.request.command;
    if (command == OperatorCommand::kGoTo || command == OperatorCommand::kStart) {
      sent = command == OperatorCommand::kGoTo;
    }
  }
  return sent;
}

// A staircase's top; a world file's goal, or, without one, where the module says that it has ended.
bool has_arrived(const ClimbSummary& s, const ClimbEnding& ending) {
  if (!s.options.world) return s.steps_total > 0 && s.steps_climbed == s.steps_total;
  return s.route.goal_reached.value_or(ending.phase == GaitPhase::kFinished);
}

// How far it came.
std::string way_of(const ClimbSummary& s) {
  if (!s.options.world) return sentence("%.0f of %.0f steps", s.steps_climbed, s.steps_total);
  std::string way = sentence("%.0f footsteps", static_cast<double>(s.footsteps.size()));
  if (s.route.surfaces_stood_on.empty()) return way;
  way += (s.footsteps.empty() ? ", on \"" : ", the last on \"") + s.route.surfaces_stood_on.back() + "\"";
  if (s.route.goal_reached == false) way += sentence(", %.2f m from the goal", s.route.goal_distance_m);
  return way;
}

std::string success_of(const ClimbSummary& s) {
  const double clearance_mm = s.swing_clearance_min_m * 1e3;
  if (!s.options.world) {
    return "Climbed " + way_of(s) +
           sentence(" in %.1f s (%.2f s per step), least sole margin %.1f mm, least swing clearance %.1f mm",
                    s.climb_time_s, s.seconds_per_step, s.sole_margin_min_m * 1e3, clearance_mm);
  }
  std::string text = (s.route.goal_reached ? "Reached the goal in " : "Ended by itself after ") +
                     sentence("%.1f s, ", s.ended_at_s) + way_of(s);
  if (!std::isnan(s.sole_margin_min_m)) text += sentence(", least sole margin %.1f mm", s.sole_margin_min_m * 1e3);
  if (!std::isnan(clearance_mm)) text += sentence(", least swing clearance %.1f mm", clearance_mm);
  return text;
}

std::string reason_of(const ClimbSummary& s, const ClimbEnding& ending) {
  const std::string climbed = way_of(s);
  const std::string over_the_edge =
      sentence("A sole stood %.1f mm over the edge of its tread", -s.sole_margin_min_m * 1e3);
  const bool over = s.sole_margin_min_m < 0.0;
  const bool all_climbed = has_arrived(s, ending);
  const std::string why = why_stopped(ending.stop_reason, ending.stop_measured_m);
  if (s.pass) {
    std::string reason = success_of(s);
    if (ending.module_state == ModuleState::kFallen) return reason + "; the module took the robot for fallen there.";
    if (ending.module_state == ModuleState::kReleased) return reason + "; it handed the robot over there.";
    if (ending.phase == GaitPhase::kStopped) return reason + "; the module stopped there: " + why + ".";
    return reason + (ending.phase == GaitPhase::kFinished ? "." : "; the run ended before the module did.");
  }
  if (s.interrupted_by != 0) return "The run was interrupted after " + climbed + ".";
  if (s.fell) return "Fell after " + climbed + ": " + ending.fall_reason;
  if (!s.route.stood_on_wrongly.empty()) {
    return "A foot stood on \"" + s.route.stood_on_wrongly + "\", which is not to be stood on.";
  }
  if (!all_climbed && ending.module_state == ModuleState::kFallen) {
    return "The module took the robot for fallen after " + climbed + ", and damped its joints.";
  }
  if (!all_climbed && ending.module_state == ModuleState::kReleased) {
    return "The module handed the robot over after " + climbed + ".";
  }
  if (!all_climbed && ending.phase == GaitPhase::kStopped) {
    return "The module stopped after " + climbed + ": " + why + ".";
  }
  if (ending.arming_waits_for.leans()) {
    return sentence("The module did not arm: %.0f ", ending.arming_waits_for.lean_deg) +
           std::string(text_of(ending.arming_waits_for.what)) + ".";
  }
  // A step counts where both soles rest inside its edges, so a sole over one may be why the count is short.
  if (!all_climbed && ending.phase == GaitPhase::kFinished) {
    if (over) return over_the_edge + "; " + climbed + " count.";
    if (was_sent(s.options)) {
      return "The module ended after " + climbed + ": it took the place where it stood for the one it was sent to.";
    }
    return "The module ended the climb after " + climbed + ": " + why_stopped(StopReason::kTop, 0.0) + ".";
  }
  if (!all_climbed) return why_ended_early(climbed, ending);
  if (s.heap_calls != 0) {
    return "The module called the heap, " + std::to_string(s.heap_calls) + " times in all, first from " +
           (ending.heap_first_caller.empty() ? "an unknown function" : ending.heap_first_caller) + ".";
  }
  if (over || (!s.options.world && std::isnan(s.sole_margin_min_m))) return over_the_edge + ".";
  if (s.options.world && s.route.body_clearance_min_m <= 0.0) {
    return sentence("The body came within %.1f mm of a solid (0 or less is a collision).",
                    s.route.body_clearance_min_m * 1e3);
  }
  return sentence("A foot came within %.1f mm of the stairs (0 or less is a collision).",
                  s.swing_clearance_min_m * 1e3);
}

}  // namespace

void judge(ClimbSummary& s, const ClimbEnding& ending) {
  bool is_clean = s.sole_margin_min_m >= 0.0 && s.swing_clearance_min_m > 0.0;
  if (s.options.world) {  // a way may be without an edge, and there may be none to go
    is_clean = !(s.sole_margin_min_m < 0.0) && !(s.swing_clearance_min_m <= 0.0) &&
               !(s.route.body_clearance_min_m <= 0.0) && s.route.stood_on_wrongly.empty();
  }
  s.pass = has_arrived(s, ending) && !s.fell && is_clean && s.heap_calls == 0 && s.interrupted_by == 0;
  if (ending.phase == GaitPhase::kStopped) s.stop_sentence = why_stopped(ending.stop_reason, ending.stop_measured_m);
  s.reason = reason_of(s, ending);
  for (const Push& push : s.options.pushes) {
    if (push.at_s < s.ended_at_s) continue;
    s.reason += sentence(" The push at %g s never came: the run ended at %.1f s.", push.at_s, s.ended_at_s);
  }
}

}  // namespace polygmap::sim
