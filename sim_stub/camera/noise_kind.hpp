// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace polygmap::sim {

// Correlated noise is what real cameras have; what is tuned on white noise shatters on it.
enum class NoiseKind { kWhite, kCorrelated };

}  // namespace polygmap::sim
