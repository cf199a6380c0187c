// SPDX-License-Identifier: Apache-2.0
#include "firmware/live/live_text.hpp"

#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <string_view>

namespace polygmap {
namespace {

[[gnu::format(printf, 1, 2)]] std::string print(const char* format, ...) {
  std::array<char, 1024> text{};
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text.data(), text.size(), format, arguments);
  va_end(arguments);
  return text.data();
}

std::string print_number(const char* format, double value) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string seconds_text(double age_s) { return std::isnan(age_s) ? "none" : print("%.3f s", age_s); }
std::string mm_text(double length_m) { return std::isinf(length_m) ? "free" : print("%.0f mm", 1e3 * length_m); }
std::string us_text(double time_us) { return std::isnan(time_us) ? "-" : print("%.0f", time_us); }
std::string rate_text(const LiveView& view) {
  if (std::isnan(view.cycles_per_s)) return "rate not known yet";
  std::string text = print("%.0f cycles/s", view.cycles_per_s);
  if (!view.is_virtual) return text;
  text += print(", %.2f of the wall clock's speed", view.speed);
  if (view.asked_speed > 0.0) text += print(", asked %.2f", view.asked_speed);
  if (view.is_too_slow()) text += ": this machine does not keep that pace";
  return text;
}
std::string state_text(const LiveView& view) {
  std::string text = view.state;
  if (view.waits_for != "nothing") text += ", waits for " + view.waits_for;
  text += ", " + view.phase;
  if (view.stop_reason != "none") text += ", stopped: " + view.stop_reason;
  return text;
}
std::string step_text(const LiveView& view) {
  if (view.step.number == 0) return print("no step yet, treads climbed %u", view.treads);
  return print("step %u %s %s, treads climbed %u", view.step.number, view.step.is_right ? "right" : "left",
               view.step.onto_tread ? "onto a tread" : "on the floor", view.treads);
}
std::string worst_text(const LiveView& view) {
  if (view.worst_row >= view.rows.size()) return "none yet";
  const LiveRow& row = view.rows[view.worst_row];
  return print("%s, slack %.0f us of %.0f%s", row.name.c_str(), row.robot.worst_slack_us, row.budget_us,
               view.is_virtual ? " by its work" : "");
}
std::string next_text(const LiveView& view, std::size_t foot) {
  const LiveFoothold& next = *view.next[foot];
  return print("%s x %.3f y %.3f z %.3f m, margin %s, toe %s", foot == 1 ? "right" : "left", next.odom_p_sole_m[0],
               next.odom_p_sole_m[1], next.odom_p_sole_m[2], mm_text(next.margin_m).c_str(),
               mm_text(next.toe_margin_m).c_str());
}
std::string events_text(const LiveEvents& events) {
  std::string text;
  for (const auto& [name, count] : events) text += print("%s%s %u", text.empty() ? "" : ", ", name.c_str(), count);
  return text.empty() ? "none" : text;
}

// A long list goes on below, indented.
void add_wrapped(std::vector<std::string>& lines, const std::string& head, std::string_view text, std::size_t width) {
  std::string line = head;
  while (!text.empty()) {
    const std::size_t end = text.find(", ");
    const std::string_view word = text.substr(0, end == std::string_view::npos ? text.size() : end + 2);
    if (line.size() > head.size() && line.size() + word.size() > width) {
      lines.push_back(line);
      line.assign(head.size(), ' ');
    }
    line += word;
    text.remove_prefix(word.size());
  }
  lines.push_back(line);
}

std::string json_number(double value, const char* format = "%.6g") {
  return std::isfinite(value) ? print_number(format, value) : "null";
}
void add_cost(std::string& json, const char* prefix, const LiveCost& cost) {
  json += print(",\"%smean_us\":%s,\"%sworst_us\":%s", prefix, json_number(cost.mean_us).c_str(), prefix,
                json_number(cost.worst_us).c_str());
}
void add_row(std::string& json, const LiveRow& row, bool is_virtual) {
  json += print("{\"row\":\"%s\",\"budget_us\":%.0f", row.name.c_str(), row.budget_us);
  add_cost(json, "", row.robot);
  json += print(",\"mean_slack_us\":%s,\"worst_slack_us\":%s", json_number(row.robot.mean_slack_us).c_str(),
                json_number(row.robot.worst_slack_us).c_str());
  if (is_virtual) add_cost(json, "host_", row.host);
  json += print(",\"runs\":%llu,\"overruns\":%llu,\"shed\":%llu}", static_cast<unsigned long long>(row.runs),
                static_cast<unsigned long long>(row.overruns), static_cast<unsigned long long>(row.shed));
}
std::string json_foothold(const std::optional<LiveFoothold>& next) {
  if (!next) return "null";
  return print(
      "{\"odom_p_sole_m\":[%.4f,%.4f,%.4f],\"odom_yaw_rad\":%.4f,\"margin_m\":%s,\"toe_margin_m\":%s,\"polygon\":%u}",
      next->odom_p_sole_m[0], next->odom_p_sole_m[1], next->odom_p_sole_m[2], next->odom_yaw_rad,
      json_number(next->margin_m).c_str(), json_number(next->toe_margin_m).c_str(), next->polygon);
}
void add_events(std::string& json, const char* key, const LiveEvents& events) {
  json += print(",\"%s\":{", key);
  const char* between = "";
  for (const auto& [name, count] : events) {
    json += print("%s\"%s\":%u", between, name.c_str(), count);
    between = ",";
  }
  json += "}";
}

}  // namespace

std::vector<std::string> table_of(const LiveView& view, std::size_t width) {
  std::vector<std::string> lines;
  lines.push_back(print("%8.1f s%s  ", view.time_s, view.is_virtual ? " simulated" : "") + state_text(view));
  lines.push_back("step     " + step_text(view));
  lines.push_back("rate     " + rate_text(view));
  lines.push_back("age      picture " + seconds_text(view.picture_age_s) + ", map " + seconds_text(view.map_age_s) +
                  ", lidar pose " + seconds_text(view.lio_age_s));
  for (std::size_t foot = 0; foot < view.next.size(); ++foot) {
    if (view.next[foot]) lines.push_back("next     " + next_text(view, foot));
  }
  if (!view.next[0] && !view.next[1]) lines.push_back("next     no foothold: " + view.no_way);
  add_wrapped(lines, "faults   ", events_text(view.faults), width);
  lines.push_back("worst    " + worst_text(view));
  lines.push_back(std::string("row         budget   mean  worst   slack: mean  worst  overrun  shed") +
                  (view.is_virtual ? "  host: mean  worst" : "  us"));
  for (const LiveRow& row : view.rows) {
    std::string line = print("%-10s %7.0f %6s %6s %13s %6s %8llu %5llu", row.name.c_str(), row.budget_us,
                             us_text(row.robot.mean_us).c_str(), us_text(row.robot.worst_us).c_str(),
                             us_text(row.robot.mean_slack_us).c_str(), us_text(row.robot.worst_slack_us).c_str(),
                             static_cast<unsigned long long>(row.overruns), static_cast<unsigned long long>(row.shed));
    if (view.is_virtual)
      line += print(" %11s %6s", us_text(row.host.mean_us).c_str(), us_text(row.host.worst_us).c_str());
    lines.push_back(line);
  }
  if (view.is_virtual)
    lines.push_back("us of a robot, by the work that is counted; host: us of this machine, which judge no robot");
  lines.push_back(print("cycles   %llu, overrun %llu, skipped %llu", static_cast<unsigned long long>(view.cycles),
                        static_cast<unsigned long long>(view.cycle_overruns),
                        static_cast<unsigned long long>(view.skipped_cycles)));
  add_wrapped(lines, "limits   ", events_text(view.limits), width);
  for (std::string& line : lines) {
    if (line.size() > width) line.resize(width);
  }
  return lines;
}

std::string line_of(const LiveView& view) {
  std::string line = print("%.1f s ", view.time_s) + state_text(view) + "; " + step_text(view) + "; " +
                     rate_text(view) + "; worst row " + worst_text(view) + "; picture " +
                     seconds_text(view.picture_age_s) + ", map " + seconds_text(view.map_age_s) + ", lidar pose " +
                     seconds_text(view.lio_age_s);
  for (std::size_t foot = 0; foot < view.next.size(); ++foot) {
    if (view.next[foot]) line += "; next " + next_text(view, foot);
  }
  if (!view.next[0] && !view.next[1]) line += "; no next foothold: " + view.no_way;
  return line + "; faults " + events_text(view.faults);
}

std::string json_of(const LiveView& view) {
  std::string json = print("{\"t_s\":%.3f,\"clock\":\"%s\",\"state\":\"%s\",\"phase\":\"%s\",\"stop_reason\":\"%s\"",
                           view.time_s, view.is_virtual ? "simulated" : "monotonic", view.state.c_str(),
                           view.phase.c_str(), view.stop_reason.c_str());
  json += print(",\"waits_for\":\"%s\",\"treads\":%u", view.waits_for.c_str(), view.treads);
  const char* const foot = view.step.is_right ? "right" : "left";
  json += view.step.number == 0 ? ",\"step\":null"
                                : print(",\"step\":{\"number\":%u,\"foot\":\"%s\",\"onto_tread\":%s}", view.step.number,
                                        foot, view.step.onto_tread ? "true" : "false");
  json += print(",\"cycles\":%llu,\"cycle_overruns\":%llu,\"skipped_cycles\":%llu",
                static_cast<unsigned long long>(view.cycles), static_cast<unsigned long long>(view.cycle_overruns),
                static_cast<unsigned long long>(view.skipped_cycles));
  json += print(",\"cycles_per_s\":%s,\"speed\":%s,\"asked_speed\":%s", json_number(view.cycles_per_s, "%.1f").c_str(),
                json_number(view.speed, "%.3f").c_str(),
                view.asked_speed > 0.0 ? json_number(view.asked_speed).c_str() : "null");
  json += print(",\"age_s\":{\"picture\":%s,\"map\":%s,\"lio\":%s}", json_number(view.picture_age_s, "%.3f").c_str(),
                json_number(view.map_age_s, "%.3f").c_str(), json_number(view.lio_age_s, "%.3f").c_str());
  json += print(",\"next\":{\"left\":%s,\"right\":%s,\"no_way\":\"%s\"}", json_foothold(view.next[0]).c_str(),
                json_foothold(view.next[1]).c_str(), view.no_way.c_str());
  const bool has_worst = view.worst_row < view.rows.size();
  json += has_worst ? print(",\"worst_row\":\"%s\"", view.rows[view.worst_row].name.c_str()) : ",\"worst_row\":null";
  json += ",\"rows\":[";
  for (const LiveRow& row : view.rows) {
    if (&row != view.rows.data()) json += ",";
    add_row(json, row, view.is_virtual);
  }
  json += "]";
  add_events(json, "faults", view.faults);
  add_events(json, "limits", view.limits);
  json += "}";
  return json;
}

}  // namespace polygmap
