// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/camera/depth_noise.hpp"

#include <algorithm>
#include <cmath>

namespace polygmap::sim {
namespace {

constexpr std::size_t kWhiteCount = 1U << 19U;
constexpr std::size_t kFieldSide = 1024;        // leaves 384 x 544 places for a 640 x 480 window
constexpr double kFieldNeighbours = 8.0 / 9.0;  // correlation of neighbours in it
constexpr double kDropout = 0.05;
constexpr float kMixed = 0.4F;  // of the pixels at a jump
constexpr float kJump_mm = 30.0F;
constexpr int kWarpCell_px = 8;
constexpr int kWarpRadius_cells = 4;  // a box of 72 px
constexpr double kWarpPeriod_s = 0.5;

// Box blur of width 2 radius + 1 along both axes, wrapped around.
void blur(std::vector<float>& field, std::size_t side, std::size_t radius) {
  std::vector<float> line(side);
  for (int axis = 0; axis < 2; ++axis) {
    const std::size_t step = axis == 0 ? 1 : side, stride = axis == 0 ? side : 1;
    for (std::size_t i = 0; i < side; ++i) {
      float* cells = field.data() + i * stride;
      for (std::size_t j = 0; j < side; ++j) line[j] = cells[j * step];
      double sum = 0.0;
      for (std::size_t j = 0; j < 2 * radius + 1; ++j) sum += static_cast<double>(line[(j + side - radius) % side]);
      for (std::size_t j = 0; j < side; ++j) {
        cells[j * step] = static_cast<float>(sum);
        sum +=
            static_cast<double>(line[(j + radius + 1) % side]) - static_cast<double>(line[(j + side - radius) % side]);
      }
    }
  }
}

void normalise(std::vector<float>& field) {
  double sum = 0.0, squares = 0.0;
  for (const float x : field) {
    sum += static_cast<double>(x);
    squares += static_cast<double>(x) * static_cast<double>(x);
  }
  const auto n = static_cast<double>(field.size());
  const double mean = sum / n, sigma = std::sqrt(squares / n - mean * mean);
  for (float& x : field) x = static_cast<float>((static_cast<double>(x) - mean) / sigma);
}

}  // namespace

// The same for every seed: a seed only chooses where to read.
struct DepthNoiseTables {
  std::vector<float> white;
  std::vector<std::uint16_t> keep_white;  // 0 = dropout, 0xFFFF
  std::vector<float> field;               // correlated over 9 px
  std::vector<std::uint16_t> keep_field;  // dropouts in blobs

  static std::shared_ptr<const DepthNoiseTables> get() {
    static const auto tables = std::make_shared<const DepthNoiseTables>();
    return tables;
  }
  DepthNoiseTables() {
    const auto normals = [](std::uint64_t seed, std::size_t count) {
      const CounterNoise noise(seed, Stream::kTables);
      std::vector<float> out(count);
      for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<float>(noise.normal(i));
      return out;
    };
    white = normals(1, kWhiteCount);
    keep_white.resize(kWhiteCount);
    const CounterNoise drop(2, Stream::kTables);
    for (std::size_t i = 0; i < kWhiteCount; ++i) keep_white[i] = drop.uniform(i) < kDropout ? 0 : 0xFFFF;

    field = normals(3, kFieldSide * kFieldSide);
    blur(field, kFieldSide, 4);
    normalise(field);
    std::vector<float> blobs = normals(4, kFieldSide * kFieldSide);
    blur(blobs, kFieldSide, 2);
    std::vector<float> sorted = blobs;
    const auto cut =
        sorted.begin() + static_cast<std::ptrdiff_t>((1.0 - kDropout) * static_cast<double>(sorted.size()));
    std::nth_element(sorted.begin(), cut, sorted.end());
    keep_field.resize(blobs.size());
    for (std::size_t i = 0; i < blobs.size(); ++i) keep_field[i] = blobs[i] > *cut ? 0 : 0xFFFF;
  }
};

namespace {

struct WarpGrid {
  int columns, rows;
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(columns * rows); }
};
WarpGrid warp_grid(const CameraIntrinsics& k) {
  return {k.width_px / kWarpCell_px + 2, k.height_px / kWarpCell_px + 2};
}

// A smooth unit-variance field, new for every key.
std::vector<float> draw_warp(const CameraIntrinsics& intrinsics, std::uint64_t seed, std::uint64_t key) {
  const WarpGrid grid = warp_grid(intrinsics);
  const CounterNoise noise(seed ^ mix64(key + 1), Stream::kDepthWarp);
  const int width = grid.columns + 2 * kWarpRadius_cells, height = grid.rows + 2 * kWarpRadius_cells;
  std::vector<double> raw(static_cast<std::size_t>(width * height));
  for (std::size_t i = 0; i < raw.size(); ++i) raw[i] = noise.normal(i);
  constexpr int kBox = 2 * kWarpRadius_cells + 1;
  std::vector<float> out(grid.size());
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      double sum = 0.0;
      for (int i = 0; i < kBox; ++i) {
        for (int j = 0; j < kBox; ++j) sum += raw[static_cast<std::size_t>((r + i) * width + c + j)];
      }
      out[static_cast<std::size_t>(r * grid.columns + c)] = static_cast<float>(sum / kBox);
    }
  }
  return out;
}

// Depths of a row in mm; 0 beyond the range.
void depths_mm(const float* __restrict inverse_depth, float* __restrict z_mm, int width, float least_inverse) {
  for (int u = 0; u < width; ++u) {
    const float inverse = std::max(inverse_depth[u], least_inverse);
    const float z = 1000.0F / inverse;
    z_mm[u] = inverse_depth[u] >= least_inverse ? z : 0.0F;
  }
}

struct RowSources {
  const float* z_mm;
  const float* inverse_depth;
  const float* plane_distance;
  const float* inverse_length;
  const float* white;
  const float* field;  // null: white noise only
  const float* warp_mm;
};
// Standard deviation of z mm at normal incidence, mm.
struct SigmaOfDepth {
  float base_mm, slope, quadratic_per_mm;
};
// Of unit variance together.
struct NoiseMix {
  float white, field;
};

void add_noise(const RowSources& s, const SigmaOfDepth& sigma, const NoiseMix& mix, float* __restrict depth_mm,
               int width, float strength) {
  constexpr float kLeastCosine = 0.258819045F;  // 75 degrees
  const float* __restrict z_mm = s.z_mm, * __restrict white = s.white, * __restrict warp = s.warp_mm;
  const float* __restrict inverse = s.inverse_depth, * __restrict plane = s.plane_distance, * __restrict length = s.inverse_length;
  const float base = sigma.base_mm, slope = sigma.slope, quadratic = sigma.quadratic_per_mm;
  if (s.field == nullptr) {
    for (int u = 0; u < width; ++u) {
      const float cosine = std::max(plane[u] * inverse[u] * length[u], kLeastCosine);
      depth_mm[u] = z_mm[u] + strength * white[u] * (base + (slope + quadratic * z_mm[u]) * z_mm[u]) / cosine;
    }
    return;
  }
  const float* __restrict field = s.field;
  for (int u = 0; u < width; ++u) {
    const float cosine = std::max(plane[u] * inverse[u] * length[u], kLeastCosine);
    const float noise = mix.white * white[u] + mix.field * field[u];
    depth_mm[u] = z_mm[u] + strength * noise * (base + (slope + quadratic * z_mm[u]) * z_mm[u]) / cosine + warp[u];
  }
}

void find_jumps(const float* __restrict z_mm, const float* __restrict below_mm, std::uint8_t* __restrict jump,
                int width) {
  for (int u = 0; u + 1 < width; ++u) {
    const bool across = std::abs(z_mm[u + 1] - z_mm[u]) > kJump_mm;
    const bool down = std::abs(below_mm[u] - z_mm[u]) > kJump_mm;
    jump[u] = static_cast<std::uint8_t>((across ? 1 : 0) | (down ? 2 : 0));
  }
  jump[width - 1] = std::abs(below_mm[width - 1] - z_mm[width - 1]) > kJump_mm ? 2 : 0;
}

void quantise(const float* __restrict depth_mm, const float* __restrict z_mm, const std::uint16_t* __restrict keep,
              std::uint16_t* __restrict out, int width, float units_per_mm) {
  for (int u = 0; u < width; ++u) {
    const float units = std::min(std::max(depth_mm[u] * units_per_mm + 0.5F, 0.0F), 65535.0F);
    const int value = z_mm[u] > 0.0F ? static_cast<int>(units) : 0;
    out[u] = static_cast<std::uint16_t>(value & keep[u]);
  }
}

}  // namespace

CameraNoise::CameraNoise(const Params& params, const CameraIntrinsics& intrinsics, std::uint64_t seed)
    : params_(params),
      intrinsics_(intrinsics),
      seed_(seed),
      frame_noise_(seed, Stream::kDepthFrame),
      row_noise_(seed, Stream::kDepthRows),
      edge_noise_(seed, Stream::kDepthEdges),
      tables_(DepthNoiseTables::get()),
      warp_(warp_grid(intrinsics).size()) {
  const auto width = static_cast<std::size_t>(intrinsics.width_px);
  warp_row_.resize(width + kWarpCell_px);
  depth_row_.resize(width);
  z_row_.resize(width);
  z_below_row_.resize(width);
  jump_.resize(width);
  if (params_.kind == NoiseKind::kCorrelated) fixed_warp_ = draw_warp(intrinsics_, seed_, 0);
}

void CameraNoise::prepare_warp(double time_s) {
  const double periods = time_s / kWarpPeriod_s;
  const auto key = static_cast<std::int64_t>(std::floor(periods));
  if (key != warp_key_) {
    earlier_warp_ = key == warp_key_ + 1 && !later_warp_.empty()
                        ? later_warp_
                        : draw_warp(intrinsics_, seed_, static_cast<std::uint64_t>(key) + 1);
    later_warp_ = draw_warp(intrinsics_, seed_, static_cast<std::uint64_t>(key) + 2);
    warp_key_ = key;
  }
  // From one draw to the next at constant variance: correlation 0.32 after 0.5 s, 0 after 1 s.
  const double phase = (periods - static_cast<double>(key)) * 0.5 * kPi;
  const double half = 1e3 * params_.warp_m * params_.strength * std::sqrt(0.5);
  const auto fixed = static_cast<float>(half), earlier = static_cast<float>(half * std::cos(phase)),
             later = static_cast<float>(half * std::sin(phase));
  for (std::size_t i = 0; i < warp_.size(); ++i) {
    warp_[i] = fixed * fixed_warp_[i] + earlier * earlier_warp_[i] + later * later_warp_[i];
  }
}

void CameraNoise::warp_row(int v) {
  const WarpGrid grid = warp_grid(intrinsics_);
  const int cell = v / kWarpCell_px;
  const float down = static_cast<float>(v % kWarpCell_px) / static_cast<float>(kWarpCell_px);
  const float* upper = warp_.data() + cell * grid.columns;
  const float* lower = upper + grid.columns;
  float left = upper[0] + down * (lower[0] - upper[0]);
  for (int c = 0; c * kWarpCell_px < intrinsics_.width_px; ++c) {
    const float right = upper[c + 1] + down * (lower[c + 1] - upper[c + 1]);
    const float slope = (right - left) / static_cast<float>(kWarpCell_px);
    for (int i = 0; i < kWarpCell_px; ++i) {
      warp_row_[static_cast<std::size_t>(c * kWarpCell_px + i)] = left + slope * static_cast<float>(i);
    }
    left = right;
  }
}

// Flying pixels: a pixel at a jump in depth sees part of both sides; the pair to the right first, then the one below.
void CameraNoise::mix_edges(std::uint64_t frame, int v, const float* z_mm, const float* z_below_mm) {
  for (int u = 0; u < intrinsics_.width_px; ++u) {
    const auto i = static_cast<std::size_t>(u);
    if (jump_[i] == 0) continue;
    const auto pixel = static_cast<std::uint64_t>(v) * static_cast<std::uint64_t>(intrinsics_.width_px) + i;
    const std::uint64_t bits = edge_noise_.bits(frame * static_cast<std::uint64_t>(intrinsics_.width_px) *
                                                    static_cast<std::uint64_t>(intrinsics_.height_px) +
                                                pixel);
    const auto part = [&](unsigned shift) { return static_cast<float>((bits >> shift) & 0xFFFFU) * 0x1p-16F; };
    const auto mix = [&](float other, unsigned shift) {
      if (part(shift) >= kMixed || z_mm[u] <= 0.0F || other <= 0.0F) return;
      const float w = part(shift + 16);
      depth_row_[i] = w * z_mm[u] + (1.0F - w) * other;
    };
    if ((jump_[i] & 2U) != 0U) mix(z_below_mm[u], 0);
    if ((jump_[i] & 1U) != 0U) mix(z_mm[u + 1], 32);
  }
}

void CameraNoise::apply(const DepthRenderer& picture, std::uint64_t frame, double time_s, std::uint16_t* depth) {
  const int width = intrinsics_.width_px, height = intrinsics_.height_px;
  const bool correlated = params_.kind == NoiseKind::kCorrelated, clean = params_.strength <= 0.0;
  const auto least_inverse = static_cast<float>(1.0 / params_.range_m);
  const auto units_per_mm = static_cast<float>(1e-3 * params_.scale / intrinsics_.depth_unit_m);
  const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
  const SigmaOfDepth sigma{static_cast<float>(1e3 * params_.sigma.base_m), static_cast<float>(params_.sigma.per_metre),
                           static_cast<float>(1e-3 * params_.sigma.quadratic_per_m)};
  const double field_share = std::min(1.0, params_.sigma.correlated_share / kFieldNeighbours);
  const NoiseMix mix{static_cast<float>(std::sqrt(1.0 - field_share)), static_cast<float>(std::sqrt(field_share))};
  if (correlated) prepare_warp(time_s);

  const std::size_t places_x = kFieldSide - w, places_y = kFieldSide - h;
  const auto window = [&](std::uint64_t draw) {
    const std::uint64_t bits = frame_noise_.bits(2 * frame + draw);
    return ((bits >> 32U) % places_y) * kFieldSide + (bits & 0xFFFFFFFFU) % places_x;
  };
  const float* field = tables_->field.data() + window(0);
  const std::uint16_t* keep_field = tables_->keep_field.data() + window(1);
  const std::vector<std::uint16_t> keep_all(clean ? w : 0, 0xFFFF);

  depths_mm(picture.inverse_depth(0), z_row_.data(), width, least_inverse);
  for (int v = 0; v < height; ++v) {
    const auto row = static_cast<std::size_t>(v);
    if (v + 1 < height) {
      depths_mm(picture.inverse_depth(v + 1), z_below_row_.data(), width, least_inverse);
    } else {
      z_below_row_ = z_row_;
    }
    const std::uint64_t bits = row_noise_.bits(frame * h + row);
    const std::size_t at = (bits & 0xFFFFFFFFU) % (kWhiteCount - w), keep_at = (bits >> 32U) % (kWhiteCount - w);
    const std::uint16_t* keep = correlated ? keep_field + row * kFieldSide : tables_->keep_white.data() + keep_at;
    if (clean) {
      depth_row_ = z_row_;
      keep = keep_all.data();
    } else {
      if (correlated) warp_row(v);
      add_noise({z_row_.data(), picture.inverse_depth(v), picture.plane_distance(v), picture.inverse_length(v),
                 tables_->white.data() + at, correlated ? field + row * kFieldSide : nullptr, warp_row_.data()},
                sigma, mix, depth_row_.data(), width, static_cast<float>(params_.strength));
      find_jumps(z_row_.data(), z_below_row_.data(), jump_.data(), width);
      mix_edges(frame, v, z_row_.data(), z_below_row_.data());
    }
    quantise(depth_row_.data(), z_row_.data(), keep, depth + row * w, width, units_per_mm);
    std::swap(z_row_, z_below_row_);
  }
}

}  // namespace polygmap::sim
