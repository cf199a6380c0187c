// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/run_segmentation.hpp"

#include <algorithm>
#include <opencv2/core/hal/intrin.hpp>

namespace polygmap {
namespace {

// The same arithmetic for as many columns as a vector register holds, and for one.
struct Wide {
  using V = cv::v_float32;
  static constexpr std::int32_t kCount = V::nlanes;
  static V all(float x) noexcept { return cv::vx_setall_f32(x); }
  static V load(const float* p) noexcept { return cv::vx_load(p); }
  static void store(float* p, const V& x) noexcept { cv::v_store(p, x); }
  static V select(const V& mask, const V& a, const V& b) noexcept { return cv::v_select(mask, a, b); }
  static V both(const V& a, const V& b) noexcept { return a & b; }
  static V either(const V& a, const V& b) noexcept { return a | b; }
  static V no(const V& a) noexcept { return ~a; }
  static V root(const V& a) noexcept { return cv::v_sqrt(a); }
  static V magnitude(const V& a) noexcept { return cv::v_abs(a); }
};
struct Single {
  using V = float;
  static V all(float x) noexcept { return x; }
  static V load(const float* p) noexcept { return *p; }
  static void store(float* p, V x) noexcept { *p = x; }
  static V select(bool mask, V a, V b) noexcept { return mask ? a : b; }
  static bool both(bool a, bool b) noexcept { return a && b; }
  static bool either(bool a, bool b) noexcept { return a || b; }
  static bool no(bool a) noexcept { return !a; }
  static V root(V a) noexcept { return math::sqrt(a); }
  static V magnitude(V a) noexcept { return std::abs(a); }
};
static_assert(kColumns % Wide::kCount == 0);

}  // namespace

void RunSegmentation::begin(const Params& params, const DepthSigma& noise, const CameraIntrinsics& intrinsics,
                            const ColumnImage& image) noexcept {
  image_ = &image;
  column_count_ = intrinsics.width_px / kColumn_px;
  height_px_ = intrinsics.height_px;
  const double share = math::sqrt(noise.correlated_share + (1.0 - noise.correlated_share) / kColumn_px);
  outlier2_ = static_cast<float>(math::square(params.outlier_sigmas));
  bend_ = static_cast<float>(params.bend_sigmas);
  jump_share_ = static_cast<float>(params.jump_share);
  base_ = static_cast<float>(noise.base_m * share);
  per_metre_ = static_cast<float>(noise.per_metre * share);
  quadratic_ = static_cast<float>(noise.quadratic_per_m * share);
  floor_ = static_cast<float>(params.floor_m);
  max_gap_ = static_cast<float>(params.max_gap_px);
  fy_ = static_cast<float>(intrinsics.fy_px);
  cy_ = static_cast<float>(intrinsics.cy_px);
  for (std::int32_t g = 0; g < kColumns; ++g) {
    clear(g);
    runs_[static_cast<std::size_t>(g)].clear();
  }
  overflow_ = 0;
}

void RunSegmentation::clear(std::int32_t column) noexcept {
  const auto g = static_cast<std::size_t>(column);
  open_.n[g] = open_.t[g] = open_.tt[g] = open_.w[g] = open_.tw[g] = 0.0F;
  open_.first[g] = open_.a[g] = open_.b[g] = open_.mean[g] = 0.0F;
  open_.top[g] = open_.last[g] = open_.pending[g] = open_.pending_first[g] = 0.0F;
}

template <typename Lanes>
void RunSegmentation::step(std::int32_t column, float at_row, const float* inverse_depth) noexcept {
  using V = typename Lanes::V;
  const auto g = static_cast<std::size_t>(column);
  const auto all = [](float x) { return Lanes::all(x); };
  const auto load = [g](const Floats& x) { return Lanes::load(x.data() + g); };
  const auto store = [g](Floats& to, const V& x) { Lanes::store(to.data() + g, x); };
  const V zero = all(0.0F), one = all(1.0F), row = all(at_row);
  const V w = Lanes::load(inverse_depth + g), n = load(open_.n);
  const V first0 = load(open_.first), a0 = load(open_.a), b0 = load(open_.b), top0 = load(open_.top);
  const V pending0 = load(open_.pending), last0 = load(open_.last);
  const auto valid = w > zero, started = n > zero, fitted = n >= all(3.0F);

  // Residual across the line in space against sigma_z: dw^2 / (|m|^2 w^2) with m of the line in the column's plane. All
  // are multiplied by w, so that sigma is that of the inverse depth.
  const V residual = (w - (first0 + a0 + b0 * (row - top0))) * w;
  const V my = b0 * all(fy_), m0 = first0 + a0 + b0 * (all(cy_) - top0);
  const V sigma = (all(base_) * w + all(per_metre_)) * w + all(quadratic_), floor = all(floor_) * w * w;
  // Predicting one row past n has about (1 + 4 / n) of a row's variance.
  const V spread = (my * my + m0 * m0) * (sigma * sigma + floor * floor) * (one + all(4.0F) / (n + one));
  const V jump = w * (all(jump_share_) * w + all(4.0F) * sigma);
  const V limit2 = Lanes::select(fitted, all(outlier2_) * spread, jump * jump);
  const auto fits = Lanes::either(Lanes::no(started), residual * residual < limit2);
  const auto in = Lanes::both(valid, fits), out = Lanes::both(valid, Lanes::no(fits));

  // A new run starts here, or this row joins.
  const V top = Lanes::select(started, top0, row), first = Lanes::select(started, first0, w);
  const V join = Lanes::select(in, one, zero);
  const V t = row - top, dw = w - first, n1 = n + join;
  const V st = load(open_.t) + join * t, stt = load(open_.tt) + join * t * t;
  const V sw = load(open_.w) + join * dw, stw = load(open_.tw) + join * t * dw;
  const auto solvable = n1 >= all(3.0F);
  const V b = Lanes::select(solvable, (n1 * stw - st * sw) / Lanes::select(solvable, n1 * stt - st * st, one), zero);
  const V a = Lanes::select(solvable, (sw - b * st) / Lanes::select(solvable, n1, one), dw);
  const V unit = residual / Lanes::root(spread + all(1e-20F));
  const V mean0 = load(open_.mean);
  const V mean = Lanes::select(fitted, all(kMemory) * mean0 + all(1.0F - kMemory) * unit, zero);
  const V pending = Lanes::select(in, zero, Lanes::select(out, pending0 + one, pending0));
  const V last = Lanes::select(in, row, last0);
  store(open_.n, n1);
  store(open_.t, st);
  store(open_.tt, stt);
  store(open_.w, sw);
  store(open_.tw, stw);
  store(open_.first, first);
  store(open_.top, top);
  store(open_.a, Lanes::select(in, a, a0));
  store(open_.b, Lanes::select(in, b, b0));
  store(open_.mean, Lanes::select(in, mean, mean0));
  store(open_.last, last);
  store(open_.pending_first, Lanes::select(Lanes::both(out, pending0 < all(0.5F)), row, load(open_.pending_first)));
  store(open_.pending, pending);

  const auto ended = Lanes::both(out, Lanes::either(Lanes::no(fitted), pending >= all(kPending)));
  const auto bent = Lanes::both(in, Lanes::both(n1 > all(7.0F), Lanes::magnitude(mean) > all(bend_)));
  const auto gap = Lanes::both(Lanes::both(started, Lanes::no(valid)), row - last > all(max_gap_));
  store(event_,
        Lanes::select(ended, all(kOut), Lanes::select(bent, all(kBend), Lanes::select(gap, all(kGap), all(kNone)))));
}

void RunSegmentation::add_row(std::int32_t row) noexcept {
  // Whole registers; what columns beyond a narrower picture say is never read.
  const float* w = image_->inverse_depth.row(row);
  for (std::int32_t g = 0; g < kColumns; g += Wide::kCount) step<Wide>(g, static_cast<float>(row), w);
  float any = 0.0F;
  for (std::int32_t g = 0; g < column_count_; ++g) any = std::max(any, event_[static_cast<std::size_t>(g)]);
  if (any == kNone) return;
  for (std::int32_t g = 0; g < column_count_; ++g) {
    if (event_[static_cast<std::size_t>(g)] != kNone) handle(g, row);
  }
}

// Ends the column's run where it stopped fitting and starts the next one with the rows since.
void RunSegmentation::handle(std::int32_t column, std::int32_t row) noexcept {
  const auto g = static_cast<std::size_t>(column);
  float event = event_[g];
  std::int32_t at = row;
  // Replaying rows may raise events of its own, each at a later row than the one before.
  for (std::int32_t guard = 0; guard < 8 && event != kNone; ++guard) {
    constexpr std::int32_t kBentRows = 3;
    std::int32_t from = at + 1;
    if (event == kOut) {
      from = static_cast<std::int32_t>(open_.pending_first[g]);
      close(column, static_cast<std::int32_t>(open_.last[g]));
    } else if (event == kBend) {
      from = at - kBentRows + 1;
      for (std::int32_t r = from; r <= at; ++r) {
        const float w = image_->inverse_depth(column, r);
        if (!(w > 0.0F)) continue;
        const float t = static_cast<float>(r) - open_.top[g], dw = w - open_.first[g];
        open_.n[g] -= 1.0F;
        open_.t[g] -= t;
        open_.tt[g] -= t * t;
        open_.w[g] -= dw;
        open_.tw[g] -= t * dw;
      }
      const float divisor = open_.n[g] * open_.tt[g] - open_.t[g] * open_.t[g];
      if (open_.n[g] >= 3.0F && divisor > 0.0F) {
        open_.b[g] = (open_.n[g] * open_.tw[g] - open_.t[g] * open_.w[g]) / divisor;
        open_.a[g] = (open_.w[g] - open_.b[g] * open_.t[g]) / open_.n[g];
      }
      close(column, from - 1);
    } else {
      close(column, static_cast<std::int32_t>(open_.last[g]));
    }
    clear(column);
    event = kNone;
    for (std::int32_t r = from; r <= row && event == kNone; ++r) {
      step<Single>(column, static_cast<float>(r), image_->inverse_depth.row(r));
      event = event_[g];
      at = r;
    }
  }
  if (event != kNone) clear(column);
}

void RunSegmentation::close(std::int32_t column, std::int32_t bottom) noexcept {
  const auto g = static_cast<std::size_t>(column);
  if (open_.n[g] < static_cast<float>(kMinRows)) return;
  Run run;
  run.top = static_cast<std::int16_t>(open_.top[g]);
  run.bottom = static_cast<std::int16_t>(bottom);
  run.inverse_depth = open_.first[g] + open_.a[g];
  run.slope = open_.b[g];
  if (!runs_[g].try_push_back(run)) ++overflow_;
}

void RunSegmentation::finish() noexcept {
  for (std::int32_t g = 0; g < column_count_; ++g) {
    close(g, static_cast<std::int32_t>(open_.last[static_cast<std::size_t>(g)]));
  }
}

}  // namespace polygmap
