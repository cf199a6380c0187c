// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/row_hook.hpp"

namespace polygmap::daemon {

RowHook* row_hook() { return nullptr; }

}  // namespace polygmap::daemon
