// SPDX-License-Identifier: Apache-2.0
// OpenCV's universal intrinsics as wide as the compiler's flags allow: 8 floats with AVX2, otherwise 4 (SSE2, NEON).
// What a lane computes is the same in both, as long as nobody calls v_fma or v_muladd: NEON fuses them.
#pragma once

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

namespace polygmap {

// A register of 256 bits: the first of its lower half, the first of its upper half, the second ... One of 128 as it is.
inline cv::v_uint32 halves_in_turn(const cv::v_uint32& a) noexcept {
#ifdef __AVX2__
  return cv::v_uint32(_mm256_permutevar8x32_epi32(a.val, _mm256_setr_epi32(0, 4, 1, 5, 2, 6, 3, 7)));
#else
  return a;
#endif
}

}  // namespace polygmap
