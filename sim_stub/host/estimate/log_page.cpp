// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/estimate/log_page.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>

#include "algorithms/geometry/so3.hpp"
#include "sim_stub/host/estimate/estimate_report.hpp"
#include "sim_stub/host/report/report_page.hpp"
#include "sim_stub/host/report/thinning.hpp"

namespace polygmap::sim {
namespace {

constexpr std::size_t kChartRows = 4000;  // of one chart
constexpr double kDegPerRad = 180.0 / kPi, kNoValue = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<const char*, 3> kAxes{"x", "y", "z"}, kAngles{"roll", "pitch", "yaw"};

using Column = std::vector<double>;

struct Curve {
  const char* label;
  const char* look;  // what it is, by which the page draws it
  Column values;
};

// One chart's curves over the rows' time.
ReportJson chart_json(const char* group, const std::string& title, const char* unit, double step, int digits,
                      const Column& t_s, const std::vector<Curve>& curves) {
  std::vector<Column> columns;
  ReportJson lines = ReportJson::array();
  for (const Curve& curve : curves) {
    columns.push_back(curve.values);
    lines.push_back({{"label", curve.label}, {"look", curve.look}});
  }
  std::vector<double> steps(curves.size() + 1, step);
  steps.front() = 1e-4;
  ReportTable table(steps);
  std::vector<double> row(steps.size());
  for (const std::size_t i : rows_with_extremes(columns, kChartRows)) {
    row[0] = t_s[i];
    for (std::size_t c = 0; c < columns.size(); ++c) row[c + 1] = columns[c][i];
    table.add(row);
  }
  return {{"group", group},   {"title", title}, {"unit", unit},
          {"digits", digits}, {"lines", lines}, {"table", table.json()}};
}

// Roll, pitch and yaw, each next to the one before: no jump where it passes half a turn.
class Angles {
 public:
  Vec3 next(const Mat3& R) {
    Vec3 rad{std::atan2(R(2, 1), R(2, 2)), -std::asin(std::clamp(R(2, 0), -1.0, 1.0)), std::atan2(R(1, 0), R(0, 0))};
    for (int i = 0; i < 3; ++i) rad[i] += 2.0 * kPi * std::round((last_rad_[i] - rad[i]) / (2.0 * kPi));
    return last_rad_ = rad;
  }
  explicit Angles(const Vec3& near_rad) : last_rad_(near_rad) {}

 private:
  Vec3 last_rad_;
};

// Poses of the base by LIO, each at the log's row next to its stamp, laid on what is compared with once: over the first
// second of it, so that one pose's noise does not turn the rest.
std::vector<Vec3> lio_places(const EstimateLog& log, const std::vector<LioRow>& lio, const Replay& replay,
                             const Transform& base_T_lidar) {
  std::vector<Vec3> places_m(log.rows.size(), Vec3::Constant(kNoValue));
  constexpr double kLaid_s = 1.0;
  const Transform lidar_T_base = base_T_lidar.inverse();
  struct Placed {
    std::size_t row;
    Transform lio_T_base;
  };
  std::vector<Placed> placed;
  for (const LioRow& pose : lio) {
    const auto after =
        std::lower_bound(log.rows.begin(), log.rows.end(), pose.stamp_ns,
                         [](const LogRow& row, std::int64_t stamp_ns) { return row.stamp_ns < stamp_ns; });
    if (after == log.rows.end() || pose.stamp_ns < 0) continue;
    placed.push_back({static_cast<std::size_t>(after - log.rows.begin()), pose.pose * lidar_T_base});
  }
  if (placed.empty()) return places_m;
  const auto reference = [&](std::size_t row) {
    return log.has_truth ? log.rows[row].truth.true_T_base : replay.ticks[row].world_T_base;
  };
  Mat3 turns = Mat3::Zero();
  Vec3 lio_mean_m = Vec3::Zero(), mean_m = Vec3::Zero();
  double count = 0.0;
  for (const Placed& p : placed) {
    if (seconds(log.rows[p.row].stamp_ns - log.rows[placed.front().row].stamp_ns) > kLaid_s) break;
    turns += reference(p.row).R * p.lio_T_base.R.transpose();
    lio_mean_m += p.lio_T_base.p_m;
    mean_m += reference(p.row).p_m;
    count += 1.0;
  }
  const Eigen::JacobiSVD<Mat3> svd(turns, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3 world_R_lio = svd.matrixU() * svd.matrixV().transpose();
  for (const Placed& p : placed) {
    places_m[p.row] = mean_m / count + world_R_lio * (p.lio_T_base.p_m - lio_mean_m / count);
  }
  return places_m;
}

class LogPage {
 public:
  LogPage(const EstimateLog& log, const std::vector<LioRow>& lio, const Replay& replay, const ReplayOptions& options)
      : log_(log), replay_(replay), has_lio_(!lio.empty()) {
    if (has_lio_) lio_m_ = lio_places(log, lio, replay, options.robot.mounts.base_T_lidar);
    for (const LogRow& row : log.rows) t_s_.push_back(seconds(row.stamp_ns));
    Angles estimate(Vec3::Zero()), truth(Vec3::Zero());
    for (std::size_t i = 0; i < t_s_.size(); ++i) {
      estimate_rad_.push_back(estimate.next(replay.ticks[i].world_T_base.R));
      if (i == 0) truth = Angles(estimate_rad_[0]);
      if (log.has_truth) truth_rad_.push_back(truth.next(log.rows[i].truth.true_T_base.R));
    }
  }

  [[nodiscard]] ReportJson charts() const {
    ReportJson all = ReportJson::array();
    for (int k = 0; k < 3; ++k) position(all, k);
    for (int k = 0; k < 3; ++k) velocity(all, k);
    for (int k = 0; k < 3; ++k) attitude(all, k);
    if (!log_.has_truth) sigmas(all);
    innovations(all);
    return all;
  }

  // Changes: [[t_s, "stands" or "swings"], ...] of each foot, as the log states its contact.
  [[nodiscard]] ReportJson contacts() const {
    ReportJson feet = ReportJson::object();
    for (std::size_t f = 0; f < kFootCount; ++f) {
      ReportJson changes = ReportJson::array();
      bool stood = false;
      for (std::size_t i = 0; i < t_s_.size(); ++i) {
        const bool stands = log_.rows[i].contact[f] >= 0.5;
        if (i > 0 && stands == stood) continue;
        changes.push_back({rounded(t_s_[i]), stands ? "stands" : "swings"});
        stood = stands;
      }
      feet[f == 0 ? "left" : "right"] = changes;
    }
    return feet;
  }

  // What was bridged, left out or refused, and when: [{"kind", "t_s", "duration_s", "count", "text"}].
  [[nodiscard]] ReportJson events() const {
    ReportJson all = ReportJson::array();
    for (std::size_t i = 1; i < t_s_.size(); ++i) {
      if (const double gap_s = t_s_[i] - t_s_[i - 1]; gap_s > log_.gap_s())
        all.push_back(
            {{"kind", "no rows"}, {"t_s", rounded(t_s_[i - 1])}, {"duration_s", rounded(gap_s)}, {"count", 1}});
    }
    rises(all, "IMU left out", "beyond what can be true", [](const ReplayTick& tick) { return tick.imu_invalid; });
    rises(all, "outliers", "innovations so large that they got less weight",
          [](const ReplayTick& tick) { return tick.quality.outliers; });
    std::uint32_t slipping = 0;
    rises(all, "foot moves", "while it stands by the log", [&](const ReplayTick& tick) {
      slipping += tick.slips ? 1 : 0;
      return slipping;
    });
    constexpr std::array<const char*, kLioVerdictCount> kWhy{"",
                                                             "not finite",
                                                             "no rotation",
                                                             "its sigma is absurd",
                                                             "not newer than the last",
                                                             "of the future",
                                                             "too old",
                                                             "from before the start",
                                                             "too far from the odometry",
                                                             "taken as a new world",
                                                             "farther off than any goes"};
    for (std::size_t v = 1; v < kLioVerdictCount; ++v) {
      rises(all, "LIO refused", kWhy[v], [v](const ReplayTick& tick) { return tick.lio[v]; });
    }
    return all;
  }

 private:
  Column column(const std::function<double(std::size_t)>& value) const {
    Column values(t_s_.size());
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = value(i);
    return values;
  }
  [[nodiscard]] double three_sigma(std::size_t row, int state) const {
    return 3.0 * std::sqrt(std::max(replay_.ticks[row].quality.covariance(state, state), 0.0));
  }
  [[nodiscard]] Curve bound(int state, double scale) const {
    const bool is_high = scale > 0.0;
    return {is_high ? "+3σ" : "−3σ", is_high ? "high" : "low",
            column([&](std::size_t i) { return scale * three_sigma(i, state); })};
  }
  void errors(ReportJson& all, const std::string& title, const char* unit, int state, double scale,
              const std::function<double(std::size_t)>& error, std::vector<Curve> more = {}) const {
    std::vector<Curve> curves{bound(state, scale), bound(state, -scale)};
    std::move(more.begin(), more.end(), std::back_inserter(curves));
    curves.push_back({"estimate", "estimate", column([&](std::size_t i) { return scale * error(i); })});
    all.push_back(chart_json("error", title, unit, 0.01, 2, t_s_, curves));
  }

  void position(ReportJson& all, int k) const {
    const auto estimate = [&](std::size_t i) { return replay_.ticks[i].world_T_base.p_m[k]; };
    const auto odometry = [&](std::size_t i) { return replay_.ticks[i].odom_T_base.p_m[k]; };
    const auto truth = [&](std::size_t i) { return log_.rows[i].truth.true_T_base.p_m[k]; };
    const auto lio = [&](std::size_t i) { return lio_m_[i][k]; };
    const std::string axis = kAxes[static_cast<std::size_t>(k)];
    if (log_.has_truth) {
      std::vector<Curve> more;
      if (has_lio_) {
        more.push_back(
            {"without LIO", "odometry", column([&](std::size_t i) { return 1e3 * (odometry(i) - truth(i)); })});
        more.push_back({"LIO, raw", "lio", column([&](std::size_t i) { return 1e3 * (lio(i) - truth(i)); })});
      }
      errors(
          all, "Position " + axis, "mm", k, 1e3, [&](std::size_t i) { return estimate(i) - truth(i); }, more);
    }
    std::vector<Curve> curves;
    if (log_.has_truth) curves.push_back({"truth", "truth", column(truth)});
    if (has_lio_) {
      curves.push_back({"without LIO", "odometry", column(odometry)});
      curves.push_back({"LIO, raw", "lio", column(lio)});
    }
    curves.push_back({"estimate", "estimate", column(estimate)});
    all.push_back(chart_json("value", "Position " + axis, "m", 1e-4, 3, t_s_, curves));
  }

  void velocity(ReportJson& all, int k) const {
    const auto estimate = [&](std::size_t i) { return replay_.ticks[i].world_v_base_mps[k]; };
    const auto truth = [&](std::size_t i) { return log_.rows[i].truth.true_v_base_mps[k]; };
    const std::string title = std::string("Velocity ") + kAxes[static_cast<std::size_t>(k)];
    std::vector<Curve> curves;
    if (log_.has_truth) {
      errors(all, title, "mm/s", 3 + k, 1e3, [&](std::size_t i) { return estimate(i) - truth(i); });
      curves.push_back({"truth", "truth", column(truth)});
    }
    curves.push_back({"estimate", "estimate", column(estimate)});
    all.push_back(chart_json("value", title, "m/s", 1e-4, 3, t_s_, curves));
  }

  void attitude(ReportJson& all, int k) const {
    const auto at = static_cast<std::size_t>(k);
    std::vector<Curve> curves;
    if (log_.has_truth) {
      const auto turn = [&](std::size_t i) {
        return so3_log(replay_.ticks[i].world_T_base.R * log_.rows[i].truth.true_T_base.R.transpose())[k];
      };
      errors(all, std::string("Attitude, turned about the world's ") + kAxes[at], "deg", 6 + k, kDegPerRad, turn);
      curves.push_back({"truth", "truth", column([&](std::size_t i) { return kDegPerRad * truth_rad_[i][k]; })});
    }
    curves.push_back({"estimate", "estimate", column([&](std::size_t i) { return kDegPerRad * estimate_rad_[i][k]; })});
    all.push_back(chart_json("value", std::string("Attitude, ") + kAngles[at], "deg", 1e-3, 2, t_s_, curves));
  }

  void sigmas(ReportJson& all) const {
    struct Group {
      const char *title, *unit;
      int first;
      double scale;
    };
    for (const Group& group : {Group{"3σ of the position", "mm", 0, 1e3}, Group{"3σ of the velocity", "mm/s", 3, 1e3},
                               Group{"3σ of the attitude, about the world's axes", "deg", 6, kDegPerRad}}) {
      std::vector<Curve> curves;
      constexpr std::array<const char*, 3> kLooks{"first", "second", "third"};
      for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(k);
        curves.push_back({kAxes[at], kLooks[at],
                          column([&](std::size_t i) { return group.scale * three_sigma(i, group.first + k); })});
      }
      all.push_back(chart_json("sigma", group.title, group.unit, 1e-3, 2, t_s_, curves));
    }
  }

  void innovations(ReportJson& all) const {
    struct Group {
      MeasurementGroup group;
      const char *label, *look;
    };
    std::vector<Curve> curves;
    for (const Group& of : {Group{MeasurementGroup::kFootPosition, "foot position", "first"},
                            Group{MeasurementGroup::kLioPosition, "LIO position", "second"},
                            Group{MeasurementGroup::kLioYaw, "LIO yaw", "third"}}) {
      if (replay_.ticks.back().quality.innovations_of(of.group).count == 0) continue;
      curves.push_back({of.label, of.look,
                        column([&](std::size_t i) { return replay_.ticks[i].quality.innovations_of(of.group).last; })});
    }
    if (curves.empty()) return;
    all.push_back(chart_json("innovation", "Squared innovations over their variances", "", 0.01, 2, t_s_, curves));
  }

  // An event where a count of something rises; those within a thousandth of the log are one.
  void rises(ReportJson& all, const char* kind, const char* text,
             const std::function<std::uint32_t(const ReplayTick&)>& count) const {
    const double near_s = t_s_.back() / 1000.0;
    std::uint32_t before = 0, many = 0;
    double from_s = 0.0, last_s = 0.0;
    const auto put = [&] {
      if (many > 0)
        all.push_back({{"kind", kind},
                       {"t_s", rounded(from_s)},
                       {"duration_s", rounded(last_s - from_s)},
                       {"count", many},
                       {"text", text}});
      many = 0;
    };
    for (std::size_t i = 0; i < t_s_.size(); ++i) {
      const std::uint32_t now = count(replay_.ticks[i]);
      if (now > before) {
        if (many > 0 && t_s_[i] - last_s > near_s) put();
        if (many == 0) from_s = t_s_[i];
        last_s = t_s_[i];
        many += now - before;
      }
      before = now;
    }
    put();
  }

  const EstimateLog& log_;
  const Replay& replay_;
  bool has_lio_;
  Column t_s_;
  std::vector<Vec3> lio_m_, estimate_rad_, truth_rad_;
};

}  // namespace

ReportJson log_json(const std::string& name, const EstimateLog& log, const std::vector<LioRow>& lio,
                    const Replay& replay, const ReplayOptions& options, const std::vector<std::string>& warnings) {
  const LogPage page(log, lio, replay, options);
  return {{"format", "polygmap-log"},
          {"version", 1},
          {"name", std::filesystem::path(name).filename().string()},
          {"start_s", rounded(log.start_s)},
          {"duration_s", rounded(seconds(log.rows.back().stamp_ns))},
          {"has_truth", log.has_truth},
          {"has_lio", !lio.empty()},
          {"has_soles", log.has_soles},
          {"summary", estimate_json(log, lio, replay, options.params_hash, warnings)},
          {"contacts", page.contacts()},
          {"events", page.events()},
          {"charts", page.charts()}};
}

void write_log_page(const std::string& path, const std::string& name, const EstimateLog& log,
                    const std::vector<LioRow>& lio, const Replay& replay, const ReplayOptions& options,
                    const std::vector<std::string>& warnings) {
  write_page(path, log_json(name, log, lio, replay, options, warnings));
}

}  // namespace polygmap::sim
