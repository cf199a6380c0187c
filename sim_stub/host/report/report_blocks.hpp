// SPDX-License-Identifier: Apache-2.0
// Numbers as the report's page reads them (page/DATA.md): tables in base64, and rounded lists.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/math/transform.hpp"

namespace polygmap::sim {

using ReportJson = nlohmann::ordered_json;

[[nodiscard]] std::string base64_of(std::span<const unsigned char> bytes);

// A table of numbers that grows row by row; what is not a number is missing.
class ReportTable {
 public:
  // steps: the smallest difference that each column keeps.
  explicit ReportTable(std::vector<double> steps) : steps_(std::move(steps)), columns_(steps_.size()) {}
  // As many values as columns.
  void add(std::span<const double> row);
  // Position (0.1 mm) and quaternion x, y, z, w.
  [[nodiscard]] static ReportTable of_poses();
  void add(const Transform& pose);
  void add_missing();

  [[nodiscard]] bool empty() const noexcept { return columns_.empty() || columns_.front().empty(); }
  // A block of every so many rows, its columns as differences of integers, compressed.
  [[nodiscard]] ReportJson json(std::size_t every = 1) const;

 private:
  std::vector<double> steps_;
  std::vector<std::vector<double>> columns_;
};

// To so many digits behind the point; null where it is not finite.
[[nodiscard]] ReportJson rounded(double value, int digits = 4);
[[nodiscard]] ReportJson rounded(std::span<const double> values, int digits = 4);
[[nodiscard]] ReportJson rounded(const Vec3& value, int digits = 4);
// x, y, z, then the quaternion.
[[nodiscard]] ReportJson pose_json(const Transform& pose);

}  // namespace polygmap::sim
