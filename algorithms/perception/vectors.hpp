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
