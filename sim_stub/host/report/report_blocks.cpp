// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/report/report_blocks.hpp"

#include <lodepng.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace polygmap::sim {
namespace {

constexpr double kPosition_m = 1e-4, kQuaternion = 1.0 / 32767.0;

std::array<double, 7> numbers_of(const Transform& pose) {
  Eigen::Quaterniond q(pose.R);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();  // one of the two that mean the same
  return {pose.p_m.x(), pose.p_m.y(), pose.p_m.z(), q.x(), q.y(), q.z(), q.w()};
}

// Integers of one width, as differences; the least one of it stands for what is missing or beyond the width.
template <class Integer>
void append_differences(std::vector<unsigned char>& bytes, const std::vector<double>& column, std::size_t every,
                        double offset, double step) {
  using Unsigned = std::make_unsigned_t<Integer>;
  Unsigned before = 0;
  for (std::size_t row = 0; row < column.size(); row += every) {
    const double scaled = std::round((column[row] - offset) / step);
    const bool fits = std::abs(scaled) <= static_cast<double>(std::numeric_limits<Integer>::max());
    const auto whole = static_cast<Unsigned>(fits ? static_cast<Integer>(scaled) : std::numeric_limits<Integer>::min());
    const auto difference = static_cast<Unsigned>(whole - before);
    for (std::size_t i = 0; i < sizeof difference; ++i)
      bytes.push_back(static_cast<unsigned char>(difference >> (8 * i)));
    before = whole;
  }
}

}  // namespace

std::string base64_of(std::span<const unsigned char> bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) three = three << 8U | (k < count ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[(three >> (18 - 6 * k)) & 63U] : '=';
  }
  return text;
}

void ReportTable::add(std::span<const double> row) {
  for (std::size_t i = 0; i < columns_.size(); ++i) columns_[i].push_back(row[i]);
}

ReportTable ReportTable::of_poses() {
  return ReportTable({kPosition_m, kPosition_m, kPosition_m, kQuaternion, kQuaternion, kQuaternion, kQuaternion});
}
void ReportTable::add(const Transform& pose) { add(numbers_of(pose)); }
void ReportTable::add_missing() {
  for (auto& column : columns_) column.push_back(std::numeric_limits<double>::quiet_NaN());
}

ReportJson ReportTable::json(std::size_t every) const {
  std::vector<double> offsets;
  bool is_narrow = true;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double value : columns_[c]) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
    const bool is_unit = steps_[c] == kQuaternion;
    offsets.push_back(low <= high && !is_unit ? std::round(500.0 * (low + high)) / 1000.0 : 0.0);
    const double reach = std::max(high - offsets[c], offsets[c] - low) / steps_[c];
    is_narrow = is_narrow && !(reach > 32767.0);
  }
  std::vector<unsigned char> bytes, packed;
  for (std::size_t c = 0; c < columns_.size(); ++c) {
    if (is_narrow) {
      append_differences<std::int16_t>(bytes, columns_[c], every, offsets[c], steps_[c]);
    } else {
      append_differences<std::int32_t>(bytes, columns_[c], every, offsets[c], steps_[c]);
    }
  }
  (void)lodepng::compress(packed, bytes);
  return {{"type", is_narrow ? "i16" : "i32"},
          {"columns", columns_.size()},
          {"count", (columns_.front().size() + every - 1) / every},
          {"scale", steps_},
          {"offset", offsets},
          {"delta", true},
          {"zlib", true},
          {"data", base64_of(packed)}};
}

ReportJson rounded(double value, int digits) {
  if (!std::isfinite(value)) return nullptr;
  const double scale = std::pow(10.0, digits);
  const double whole = std::round(value * scale) / scale;
  return whole == 0.0 ? 0.0 : whole;
}
ReportJson rounded(std::span<const double> values, int digits) {
  ReportJson list = ReportJson::array();
  for (const double value : values) list.push_back(rounded(value, digits));
  return list;
}
ReportJson rounded(const Vec3& value, int digits) { return rounded(std::span(value.data(), 3), digits); }
ReportJson pose_json(const Transform& pose) {
  constexpr int kDigits = 5;
  return rounded(numbers_of(pose), kDigits);
}

}  // namespace polygmap::sim
