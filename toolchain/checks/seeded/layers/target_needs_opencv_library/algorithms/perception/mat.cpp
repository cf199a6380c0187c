// SPDX-License-Identifier: Apache-2.0
// expect: opencv2/core/mat.hpp> needs the OpenCV library
#include <opencv2/core/mat.hpp>
