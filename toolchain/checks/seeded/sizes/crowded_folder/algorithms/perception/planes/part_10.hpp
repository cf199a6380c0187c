// SPDX-License-Identifier: Apache-2.0
// expect: perception/planes: has 16 files
#pragma once
