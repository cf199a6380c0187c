// SPDX-License-Identifier: Apache-2.0
#include "algorithms/perception/image/column_image.hpp"

#include <algorithm>
#include <cstring>

#include "algorithms/perception/image/simd.hpp"

namespace polygmap {
namespace {

using Raw = cv::v_uint16;
using Words = cv::v_uint32;
using simd::all, simd::Wide;
static_assert(kColumns % Raw::nlanes == 0 && kColumn_px == 8);

constexpr std::int32_t kMostBody = kColumn_px / 4;  // half-resolution pixels: a column of more body is not seen
constexpr std::int32_t kLine = 64;                  // bytes of a cache
[[maybe_unused]] constexpr int kCountShift = 20;    // below: the sum of eight depths; from here on: how many are valid

// The range as vectors see it.
struct Range {
  Raw lowest, reach;
  explicit Range(const RawRange& range) noexcept
      : lowest(cv::vx_setall_u16(range.min)),
        reach(cv::vx_setall_u16(static_cast<std::uint16_t>(range.max - range.min))) {}
  [[nodiscard]] Raw valid(const Raw& x) const noexcept { return simd::at_most(cv::v_sub_wrap(x, lowest), reach); }
};

// Which of a register's pixels are valid; body has a flag for each two of them.
template <bool kBody>
Raw valid_pixels(const Range& range, const Raw& x, [[maybe_unused]] const std::uint8_t* body) noexcept {
  const Raw valid = range.valid(x);
  if constexpr (!kBody) return valid;
  const Words free = (cv::vx_load_expand_q(body) & cv::vx_setall_u32(kPixelBody)) == cv::vx_setzero_u32();
  return valid & cv::v_reinterpret_as_u16(free);
}

// Of a register of columns: the sum of each one's valid depths, and how many there are.
struct ColumnSums {
  Words depths, count;
};
template <bool kBody>
ColumnSums sum_columns(const Range& range, const std::uint16_t* raw, const std::uint8_t* body) noexcept {
  static_assert(kColumn_px == 2 * 4);
  std::array<Raw, 4> depths, valid;
  for (std::size_t k = 0; k < depths.size(); ++k) {
    const Raw x = cv::vx_load(raw + k * Raw::nlanes);
    valid[k] = valid_pixels<kBody>(range, x, kBody ? body + k * Words::nlanes : nullptr);
    depths[k] = x & valid[k];
  }
#ifdef __ARM_NEON
  return {simd::sums_of_eight(depths), simd::count_in_eights(valid)};
#else
  // Sum and count of pairs of pixels in one word each. A register of pixels has one column or, with AVX2, two.
  std::array<Words, 4> pairs;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const Words both = cv::v_reinterpret_as_u32(depths[k]);
    const cv::v_int32 minus_count = cv::v_dotprod(cv::v_reinterpret_as_s16(valid[k]), cv::vx_setall_s16(1));
    pairs[k] =
        (both & cv::vx_setall_u32(0xffff)) + (both >> 16) - (cv::v_reinterpret_as_u32(minus_count) << kCountShift);
  }
  Words first, second, third, fourth;
  cv::v_transpose4x4(pairs[0], pairs[1], pairs[2], pairs[3], first, second, third, fourth);  // each half by itself
  const Words sum = simd::halves_in_turn((first + second) + (third + fourth));
  return {sum & cv::vx_setall_u32((1U << kCountShift) - 1U), sum >> kCountShift};
#endif
}

Wide to_float(const Words& x) noexcept { return cv::v_cvt_f32(cv::v_reinterpret_as_s32(x)); }

struct RawPixels {
  const std::uint16_t *now, *later;  // later: to be asked for
};

// Whole registers of columns, from column 0 on. Body: whether body counts.
template <bool kBody>
void reduce_registers(const RawRange& raw_range, const RawPixels& pixels, const std::uint8_t* body,
                      std::int32_t registers, float* inverse_depth, std::uint8_t* valid, Words& measured,
                      Words& free) noexcept {
  const Range range(raw_range);
  const std::uint16_t *raw = pixels.now, *later_raw = pixels.later;
  const Words none = cv::vx_setzero_u32(), any = raw_range.min <= raw_range.max ? none == none : none;
  const cv::v_uint8 is_body = cv::vx_setall_u8(kPixelBody);
  const Wide per_metre = all(raw_range.per_metre), least = all(1.0F);
  const auto half = [&](Words& count) {
    Words seen = any;
    if constexpr (kBody) {
      const cv::v_uint8 flags = cv::vx_load(body) & is_body;
      seen = cv::v_dotprod_expand(flags, cv::vx_setall_u8(1)) <= cv::vx_setall_u32(kMostBody * kPixelBody);
      free = free - seen;
      seen = seen & any;
    }
    const ColumnSums sums = sum_columns<kBody>(range, raw, body);
    count = sums.count & seen;
    const Wide depths = to_float(sums.depths & seen);
    cv::v_store(inverse_depth, to_float(count) * per_metre / cv::v_max(depths, least));
    measured = measured + count;
    raw += 4 * Raw::nlanes;
    inverse_depth += Words::nlanes;
    if constexpr (kBody) body += 4 * Words::nlanes;
  };
  constexpr std::int32_t kRawPerRegister = kColumn_px * Raw::nlanes;
  for (std::int32_t i = 0; i < registers; ++i, valid += Raw::nlanes, later_raw += kRawPerRegister) {
    constexpr auto kLinePixels = static_cast<std::int32_t>(kLine / sizeof(std::uint16_t));
    for (std::int32_t k = 0; k < kRawPerRegister; k += kLinePixels) __builtin_prefetch(later_raw + k);
    Words left, right;
    half(left);
    half(right);
    cv::v_pack_store(valid, cv::v_pack(left, right));
  }
}

}  // namespace

void ColumnImage::transpose(std::int32_t first_row, std::int32_t last_row) noexcept {
  using Four = cv::v_float32x4;
  static_assert(kColumns % Four::nlanes == 0 && kTransposeRows == Four::nlanes);
  std::int32_t r = first_row;
  for (; r + kTransposeRows - 1 <= last_row; r += kTransposeRows) {
    for (std::int32_t g = 0; g < kColumns; g += Four::nlanes) {
      Four a, b, c, d;
      cv::v_transpose4x4(cv::v_load(inverse_depth.row(r) + g), cv::v_load(inverse_depth.row(r + 1) + g),
                         cv::v_load(inverse_depth.row(r + 2) + g), cv::v_load(inverse_depth.row(r + 3) + g), a, b, c,
                         d);
      cv::v_store(by_column.row(g) + r, a), cv::v_store(by_column.row(g + 1) + r, b);
      cv::v_store(by_column.row(g + 2) + r, c), cv::v_store(by_column.row(g + 3) + r, d);
    }
    using Bytes = cv::v_uint8x16;
    static_assert(kColumns % Bytes::nlanes == 0 && kTransposeRows == sizeof(std::uint32_t));
    for (std::int32_t g = 0; g < kColumns; g += Bytes::nlanes) {
      const auto row = [&](std::int32_t i) { return cv::v_load(valid.row(r + i) + g); };
      std::array<Bytes, 2> low, high;
      std::array<Bytes, 4> fours;
      cv::v_zip(row(0), row(2), low[0], low[1]);
      cv::v_zip(row(1), row(3), high[0], high[1]);
      cv::v_zip(low[0], high[0], fours[0], fours[1]);
      cv::v_zip(low[1], high[1], fours[2], fours[3]);
      for (std::int32_t i = 0; i < 4; ++i) {  // four columns each
        std::array<std::uint32_t, 4> four;
        cv::v_store(four.data(), cv::v_reinterpret_as_u32(fours[static_cast<std::size_t>(i)]));
        for (std::int32_t k = 0; k < 4; ++k) {
          std::memcpy(valid_by_column.row(g + 4 * i + k) + r, &four[static_cast<std::size_t>(k)],
                      sizeof(std::uint32_t));
        }
      }
    }
  }
  for (; r <= last_row; ++r) {
    for (std::int32_t g = 0; g < kColumns; ++g) {
      by_column(r, g) = inverse_depth(g, r);
      valid_by_column(r, g) = valid(g, r);
    }
  }
}

ReducedRow reduce_to_columns(const RawRange& range, const std::uint16_t* raw, const std::uint8_t* body,
                             std::int32_t columns, float* inverse_depth, std::uint8_t* valid,
                             const std::uint16_t* later_raw) noexcept {
  Words measured = cv::vx_setzero_u32(), free = measured;
  const auto reduce = [&](std::int32_t registers, const RawPixels& from, std::int32_t g) {
    if (body != nullptr) {
      reduce_registers<true>(range, from, body + kColumn_px / 2 * static_cast<std::ptrdiff_t>(g), registers,
                             inverse_depth + g, valid + g, measured, free);
    } else {
      reduce_registers<false>(range, from, nullptr, registers, inverse_depth + g, valid + g, measured, free);
    }
  };
  const std::int32_t whole = columns / Raw::nlanes;
  reduce(whole, {raw, later_raw != nullptr ? later_raw : raw}, 0);
  std::int32_t g = whole * Raw::nlanes;
  if (g < columns) {  // the driver's buffer ends with its last row
    std::array<std::uint16_t, static_cast<std::size_t>(kColumn_px) * Raw::nlanes> tail{};
    std::copy(raw + static_cast<std::ptrdiff_t>(kColumn_px) * g,
              raw + static_cast<std::ptrdiff_t>(kColumn_px) * columns, tail.begin());
    reduce(1, {tail.data(), tail.data()}, g);
    g += Raw::nlanes;
  }
  ReducedRow row{static_cast<std::int32_t>(cv::v_reduce_sum(measured)),
                 body != nullptr ? g - static_cast<std::int32_t>(cv::v_reduce_sum(free)) : 0};
  while (g > columns) {
    --g;
    row.measured_px -= valid[g];
    if (body != nullptr) {
      const std::uint8_t* flags = body + kColumn_px / 2 * g;
      const auto covered = [](std::uint8_t f) { return (f & kPixelBody) != 0; };
      row.body_columns -= std::count_if(flags, flags + kColumn_px / 2, covered) > kMostBody ? 1 : 0;
    }
    inverse_depth[g] = 0.0F;
    valid[g] = 0;
  }
  return row;
}

}  // namespace polygmap
