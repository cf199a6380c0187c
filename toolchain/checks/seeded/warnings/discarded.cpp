// SPDX-License-Identifier: Apache-2.0
// expect: Werror.*unused-(result|value)
[[nodiscard]] bool try_it() noexcept;
void careless() noexcept { try_it(); }
