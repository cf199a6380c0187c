// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/estimate/estimate_log.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "sim_stub/host/estimate/csv_table.hpp"

namespace polygmap::sim {
namespace {

// Beyond these no robot's numbers are. Stamps count from anywhere, but their differences must fit into nanoseconds.
constexpr double kMaxStamp_s = 1e11, kMaxSpan_s = 1e8;
constexpr double kMaxRate_radps = 200.0, kMaxAccel_mps2 = 2000.0, kMaxLeg_m = 20.0;
constexpr double kMaxPlace_m = 1e6, kMaxSpeed_mps = 1e3;
constexpr double kMaxGap_s = 5.0;        // nobody knows where a robot went in longer ones
constexpr double kMaxPeriod_s = 0.06;    // of rows, in the median: in less a foot lands and leaves
constexpr double kNormTolerance = 0.01;  // of a quaternion

using Columns3 = std::array<std::size_t, 3>;
using Columns4 = std::array<std::size_t, 4>;

Columns3 columns3(const CsvTable& table, const std::string& prefix, const std::string& unit) {
  return {table.column(prefix + "x" + unit), table.column(prefix + "y" + unit), table.column(prefix + "z" + unit)};
}
Columns4 quaternion_columns(const CsvTable& table, const std::string& prefix) {
  return {table.column(prefix + "qw"), table.column(prefix + "qx"), table.column(prefix + "qy"),
          table.column(prefix + "qz")};
}
Vec3 vector(const CsvTable& table, std::size_t row, const Columns3& columns, double limit) {
  return {table.number(row, columns[0], limit), table.number(row, columns[1], limit),
          table.number(row, columns[2], limit)};
}
Mat3 rotation(const CsvTable& table, std::size_t row, const Columns4& columns) {
  std::array<double, 4> q{};
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = table.number(row, columns[i], 10.0);
  const Eigen::Quaterniond quaternion(q[0], q[1], q[2], q[3]);
  if (!(std::abs(quaternion.norm() - 1.0) <= kNormTolerance)) {
    table.fail(row, "the quaternion's length is " + std::to_string(quaternion.norm()) + ", not 1");
  }
  return quaternion.normalized().toRotationMatrix();
}

std::int64_t nanoseconds(const CsvTable& table, std::size_t row, double stamp_s, double start_s) {
  const double since_s = stamp_s - start_s;
  if (!(std::abs(since_s) <= kMaxSpan_s)) table.fail(row, "the stamp is years away from the log's first one");
  return std::llround(since_s * 1e9);
}

}  // namespace

EstimateLog read_estimate_log(const std::string& path) {
  const CsvTable table(path, "t_s");
  const std::size_t stamp = table.column("t_s");
  const Columns3 gyro = columns3(table, "gyro_", "_radps"), accel = columns3(table, "accel_", "_mps2");
  const std::array<std::size_t, kFootCount> contact{table.column("left_contact"), table.column("right_contact")};
  const std::array<Columns3, kFootCount> foot{columns3(table, "left_foot_", "_m"),
                                              columns3(table, "right_foot_", "_m")};
  EstimateLog log;
  Columns3 truth_p{}, truth_v{};
  Columns4 truth_q{};
  log.has_truth = table.has_any("truth_");  // then all ten columns: half a truth is a mistake, not a log without any
  if (log.has_truth) {
    truth_p = columns3(table, "truth_p", "_m");
    truth_v = columns3(table, "truth_v", "_mps");
    truth_q = quaternion_columns(table, "truth_");
  }
  log.has_soles = table.has_any("left_foot_q") || table.has_any("right_foot_q") || table.has_any("left_foot_w") ||
                  table.has_any("right_foot_w");  // then all fourteen columns
  std::array<Columns4, kFootCount> foot_q{};
  std::array<Columns3, kFootCount> foot_w{};
  for (std::size_t f = 0; f < kFootCount && log.has_soles; ++f) {
    const std::string name = f == 0 ? "left_foot_" : "right_foot_";
    foot_q[f] = quaternion_columns(table, name);
    foot_w[f] = columns3(table, name + "w", "_radps");
  }
  log.rows.resize(table.rows());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    LogRow& row = log.rows[i];
    const double stamp_s = table.number(i, stamp, kMaxStamp_s);
    if (i == 0) log.start_s = stamp_s;
    row.stamp_ns = nanoseconds(table, i, stamp_s, log.start_s);
    if (i > 0 && row.stamp_ns <= log.rows[i - 1].stamp_ns) {
      table.fail(i, "t_s is " + std::to_string(stamp_s) + ", not later than the row before");
    }
    if (i > 0 && seconds(row.stamp_ns - log.rows[i - 1].stamp_ns) > kMaxGap_s) {
      std::ostringstream sentence;
      sentence << "t_s is " << seconds(row.stamp_ns - log.rows[i - 1].stamp_ns) << " s after the row before: more than "
               << kMaxGap_s << " s without samples cannot be bridged (are the stamps in seconds?)";
      table.fail(i, sentence.str());
    }
    row.gyro_radps = vector(table, i, gyro, kMaxRate_radps);
    row.accel_mps2 = vector(table, i, accel, kMaxAccel_mps2);
    for (std::size_t f = 0; f < kFootCount; ++f) {
      row.contact[f] = table.number(i, contact[f], 1.0);
      if (row.contact[f] < 0.0) table.fail(i, "a contact is below 0");
      row.base_p_foot_m[f] = vector(table, i, foot[f], kMaxLeg_m);
      if (!log.has_soles) continue;
      row.base_R_foot[f] = rotation(table, i, foot_q[f]);
      row.base_w_foot_radps[f] = vector(table, i, foot_w[f], kMaxRate_radps);
    }
    if (!log.has_truth) continue;
    row.truth.true_T_base = {rotation(table, i, truth_q), vector(table, i, truth_p, kMaxPlace_m)};
    row.truth.true_v_base_mps = vector(table, i, truth_v, kMaxSpeed_mps);
  }
  if (log.rows.size() < 2) table.fail(0, "is the only row, and there is nothing to estimate between rows");
  std::vector<std::int64_t> periods_ns;
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    periods_ns.push_back(log.rows[i].stamp_ns - log.rows[i - 1].stamp_ns);
  }
  const auto middle = periods_ns.begin() + static_cast<std::ptrdiff_t>(periods_ns.size() / 2);
  std::nth_element(periods_ns.begin(), middle, periods_ns.end());
  log.period_s = seconds(*middle);
  if (log.period_s > kMaxPeriod_s) {
    std::ostringstream sentence;
    sentence << "the rows up to this one come every " << log.period_s << " s, but legged odometry needs one per "
             << kMaxPeriod_s << " s at least, and was tried on 100 to 1000 Hz (are the stamps in seconds?)";
    table.fail(table.rows() - 1, sentence.str());
  }
  return log;
}

std::vector<LioRow> read_lio_log(const std::string& path, double start_s) {
  const CsvTable table(path, "stamp_s");
  const std::size_t stamp = table.column("stamp_s"), arrival = table.column("arrival_s");
  const Columns3 p = columns3(table, "p", "_m");
  const Columns4 q = quaternion_columns(table, "");
  std::vector<LioRow> rows(table.rows());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].stamp_ns = nanoseconds(table, i, table.number(i, stamp, kMaxStamp_s), start_s);
    rows[i].arrival_ns = nanoseconds(table, i, table.number(i, arrival, kMaxStamp_s), start_s);
    // A stamp may be anything, the module counts it; but what arrived is recorded as it arrived.
    if (i > 0 && rows[i].arrival_ns < rows[i - 1].arrival_ns)
      table.fail(i, "arrival_s is before that of the row before");
    rows[i].pose = {rotation(table, i, q), vector(table, i, p, kMaxPlace_m)};
  }
  return rows;
}

}  // namespace polygmap::sim
