// SPDX-License-Identifier: Apache-2.0
// expect: clang-formatted
#pragma once
inline int crooked( int a ) noexcept
{
        return a ;}
