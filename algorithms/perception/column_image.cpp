// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/column_image.hpp"

#include <algorithm>

#include "algorithms/perception/vectors.hpp"

namespace polygmap {
namespace {

using Raw = cv::v_uint16;
using Wide = cv::v_float32;
static_assert(kColumns % Raw::nlanes == 0);

void widen(const Raw& x, std::array<Wide, 2>& out) noexcept {
  cv::v_uint32 low, high;
  cv::v_expand(x, low, high);
  out = {cv::v_cvt_f32(cv::v_reinterpret_as_s32(low)), cv::v_cvt_f32(cv::v_reinterpret_as_s32(high))};
}

// w + x + y + z, which 16 bits do not hold.
void widen_sum(const Raw& w, const Raw& x, const Raw& y, const Raw& z, std::array<Wide, 2>& out) noexcept {
  std::array<cv::v_uint32, 2> sum, next;
  cv::v_expand(w, sum[0], sum[1]);
  for (const Raw* more : {&x, &y, &z}) {
    cv::v_expand(*more, next[0], next[1]);
    for (std::size_t half = 0; half < 2; ++half) sum[half] = sum[half] + next[half];
  }
  for (std::size_t half = 0; half < 2; ++half) out[half] = cv::v_cvt_f32(cv::v_reinterpret_as_s32(sum[half]));
}

}  // namespace

ReducedRow reduce_to_columns(const RawRange& range, const std::uint16_t* raw, const std::uint8_t* body,
                             std::int32_t columns, float* inverse_depth, std::uint8_t* valid) noexcept {
  const Raw lowest = cv::vx_setall_u16(range.min), none = cv::vx_setzero_u16();
  const Raw reach = cv::vx_setall_u16(static_cast<std::uint16_t>(range.max - range.min));
  const Raw all = none == none, any = range.min <= range.max ? all : none;
  const cv::v_uint8 is_body = cv::vx_setall_u8(kPixelBody);
  const Wide per_metre = cv::vx_setall_f32(range.per_metre), least = cv::vx_setall_f32(1.0F);
  Raw measured = none, free = none;
  std::array<std::uint16_t, static_cast<std::size_t>(kColumn_px) * Raw::nlanes> tail{};
  std::int32_t g = 0;
  for (; g < columns; g += Raw::nlanes) {
    const std::uint16_t* from = raw + static_cast<std::ptrdiff_t>(kColumn_px) * g;
    if (columns - g < Raw::nlanes) {  // the driver's buffer ends with its last row
      std::copy(from, raw + static_cast<std::ptrdiff_t>(kColumn_px) * columns, tail.begin());
      from = tail.data();
    }
    Raw a, b, c, d;
    cv::v_load_deinterleave(from, a, b, c, d);
    Raw seen = all;
    if (body != nullptr) seen = cv::v_reinterpret_as_u16(cv::vx_load(body + 2 * g) & is_body) == none;
    const auto good = [&](const Raw& x) {
      const Raw above = cv::v_sub_wrap(x, lowest);
      return cv::v_min(above, reach) == above;
    };
    const Raw good_a = good(a), good_b = good(b), good_c = good(c), good_d = good(d);
    const Raw count =
        cv::v_sub_wrap(none, cv::v_add_wrap(cv::v_add_wrap(good_a, good_b), cv::v_add_wrap(good_c, good_d))) & seen &
        any;
    std::array<Wide, 2> n, sum;
    widen(count, n);
    widen_sum(a & good_a, b & good_b, c & good_c, d & good_d, sum);
    for (std::size_t half = 0; half < 2; ++half) {
      cv::v_store(inverse_depth + g + static_cast<std::ptrdiff_t>(half) * Wide::nlanes,
                  n[half] * per_metre / cv::v_max(sum[half], least));
    }
    cv::v_pack_store(valid + g, count);
    measured = cv::v_add_wrap(measured, count);
    free = cv::v_sub_wrap(free, seen);
  }
  ReducedRow row{static_cast<std::int32_t>(cv::v_reduce_sum(measured)),
                 g - static_cast<std::int32_t>(cv::v_reduce_sum(free))};
  while (g > columns) {
    --g;
    row.measured_px -= valid[g];
    if (body != nullptr && ((body[2 * g] | body[2 * g + 1]) & kPixelBody) != 0) --row.body_columns;
    inverse_depth[g] = 0.0F;
    valid[g] = 0;
  }
  return row;
}

}  // namespace polygmap
