// SPDX-License-Identifier: Apache-2.0
// expect: 'volatile'
#pragma once
struct Flag {
  volatile bool raised = false;
};
