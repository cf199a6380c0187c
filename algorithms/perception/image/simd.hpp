// SPDX-License-Identifier: Apache-2.0
// OpenCV's universal intrinsics as wide as the compiler's flags allow: 8 floats with AVX2, otherwise 4 (SSE2, NEON).
// What a slot computes is the same in both, as long as nobody calls v_fma or v_muladd: NEON fuses them.
#pragma once

#include <array>
#include <cstdint>

// Outside OpenCV's own build its headers see SSE2 and no more.
#ifdef __AVX2__
#include <immintrin.h>
#define CV_SSE3 1
#define CV_SSSE3 1
#define CV_SSE4_1 1
#define CV_AVX 1
#define CV_AVX2 1
#endif
#include <opencv2/core/hal/intrin.hpp>

#ifdef __AVX2__
static_assert(cv::v_float32::nlanes == 8, "something included OpenCV's headers before and made them SSE2");
#endif

#include "algorithms/perception/image/depth_noise_model.hpp"

namespace polygmap::simd {

using Wide = cv::v_float32;
using Four = cv::v_float32x4;  // where the order of summing must not depend on the width

// One number in every slot.
template <typename T>
Wide all(T x) noexcept {
  return cv::vx_setall_f32(static_cast<float>(x));
}

inline InverseSigma<Wide> all(const InverseSigma<float>& s) noexcept {
  return {all(s.base), all(s.per_metre), all(s.quadratic)};
}
inline MeanShare<Wide> all(const MeanShare<float>& s) noexcept { return {all(s.shared), all(s.own)}; }

// 0, 1, 2 ...: a register is filled from any of them on.
inline constexpr std::array<float, 16> kSteps{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
inline Wide steps_from(std::int32_t first) noexcept { return cv::vx_load(kSteps.data() + first); }

inline Wide load_u8(const std::uint8_t* from) noexcept {
  return cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::vx_load_expand_q(from)));
}
inline Wide load_u16(const std::uint16_t* from) noexcept {
  return cv::v_cvt_f32(cv::v_reinterpret_as_s32(cv::vx_load_expand(from)));
}

// A bit for each slot of a comparison's result, or for each number below 0.
template <typename V>
std::uint32_t bits(const V& mask) noexcept {
  return static_cast<std::uint32_t>(cv::v_signmask(mask));
}

// The sums of the first, the first two ... of four numbers, all with what was summed before them, which then is all of
// it.
inline Four running_sums(const Four& x, Four& before) noexcept {
  Four sums = x + cv::v_rotate_left<1>(x);
  sums = sums + cv::v_rotate_left<2>(sums) + before;
  before = cv::v_broadcast_element<3>(sums);
  return sums;
}

// All bits where a is no more than b.
inline cv::v_uint16 at_most(const cv::v_uint16& a, const cv::v_uint16& b) noexcept {
#ifdef __ARM_NEON
  return a <= b;
#else
  return cv::v_min(a, b) == a;  // what SSE has no comparison for
#endif
}

#ifdef __ARM_NEON
// Of each of four registers: the sum of its eight numbers; and how many of them have all bits set, the others none.
inline cv::v_uint32x4 sums_of_eight(const std::array<cv::v_uint16x8, 4>& x) noexcept {
  return cv::v_uint32x4(vpaddq_u32(vpaddq_u32(vpaddlq_u16(x[0].val), vpaddlq_u16(x[1].val)),
                                   vpaddq_u32(vpaddlq_u16(x[2].val), vpaddlq_u16(x[3].val))));
}
inline cv::v_uint32x4 count_in_eights(const std::array<cv::v_uint16x8, 4>& x) noexcept {
  const auto number = [&x](std::size_t i) { return vreinterpretq_s16_u16(x[i].val); };
  const int16x8_t fours = vpaddq_s16(vpaddq_s16(number(0), number(1)), vpaddq_s16(number(2), number(3)));
  return cv::v_uint32x4(vreinterpretq_u32_s32(vnegq_s32(vpaddlq_s16(fours))));
}
#endif

// A register of 256 bits: the first of its lower half, the first of its upper half, the second ... One of 128 as it is.
inline cv::v_uint32 halves_in_turn(const cv::v_uint32& a) noexcept {
#ifdef __AVX2__
  return cv::v_uint32(_mm256_permutevar8x32_epi32(a.val, _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7)));
#else
  return a;
#endif
}

}  // namespace polygmap::simd
