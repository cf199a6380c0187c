// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/column_image.hpp"

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

// x + y, which 16 bits do not hold.
void widen_sum(const Raw& x, const Raw& y, std::array<Wide, 2>& out) noexcept {
  cv::v_uint32 x_low, x_high, y_low, y_high;
  cv::v_expand(x, x_low, x_high);
  cv::v_expand(y, y_low, y_high);
  out = {cv::v_cvt_f32(cv::v_reinterpret_as_s32(x_low + y_low)),
         cv::v_cvt_f32(cv::v_reinterpret_as_s32(x_high + y_high))};
}

}  // namespace

ReducedRow reduce_to_columns(const RawRange& range, const std::uint16_t* raw, const std::uint8_t* body,
                             std::int32_t columns, float* inverse_depth, std::uint8_t* valid) noexcept {
  const Raw lowest = cv::vx_setall_u16(range.min), none = cv::vx_setzero_u16(), one = cv::vx_setall_u16(1);
  const Raw reach = cv::vx_setall_u16(static_cast<std::uint16_t>(range.max - range.min));
  const Raw all = none == none, any = range.min <= range.max ? all : none;
  const cv::v_uint8 is_body = cv::vx_setall_u8(kPixelBody);
  const Wide per_metre = cv::vx_setall_f32(range.per_metre);
  Raw measured = none, free = none;
  std::int32_t g = 0;
  for (; g < columns; g += Raw::nlanes) {
    Raw a, b, c, d;
    cv::v_load_deinterleave(raw + static_cast<std::ptrdiff_t>(kColumn_px) * g, a, b, c, d);
    Raw seen = all;
    if (body != nullptr) seen = cv::v_reinterpret_as_u16(cv::vx_load(body + 2 * g) & is_body) == none;
    const Raw wanted = seen & any;
    const auto good = [&](const Raw& x) {
      const Raw above = cv::v_sub_wrap(x, lowest);
      return (cv::v_min(above, reach) == above) & wanted;
    };
    const Raw good_a = good(a), good_b = good(b), good_c = good(c), good_d = good(d);
    const Raw count =
        cv::v_sub_wrap(none, cv::v_add_wrap(cv::v_add_wrap(good_a, good_b), cv::v_add_wrap(good_c, good_d)));
    // Pixels that are none become 1, and leave the numerators below.
    a = cv::v_max(a & good_a, one), b = cv::v_max(b & good_b, one);
    c = cv::v_max(c & good_c, one), d = cv::v_max(d & good_d, one);
    std::array<Wide, 2> fa, fb, fc, fd, ab, cd, n;
    widen(a, fa), widen(b, fb), widen(c, fc), widen(d, fd);
    widen_sum(b & good_a, a & good_b, ab);
    widen_sum(d & good_c, c & good_d, cd);
    widen(cv::v_max(count, one), n);
    for (std::size_t half = 0; half < 2; ++half) {
      // 1/a + 1/b + 1/c + 1/d with one division.
      const Wide lower = fa[half] * fb[half], upper = fc[half] * fd[half];
      const Wide sum = (ab[half] * upper + cd[half] * lower) * per_metre / (lower * upper * n[half]);
      cv::v_store(inverse_depth + g + static_cast<std::ptrdiff_t>(half) * Wide::nlanes, sum);
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
