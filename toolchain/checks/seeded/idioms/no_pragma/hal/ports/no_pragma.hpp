// SPDX-License-Identifier: Apache-2.0
// expect: no #pragma once
struct Twice {};
