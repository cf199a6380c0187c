# SPDX-License-Identifier: Apache-2.0
# expect: it has usr/include/polygmap.hpp, which nothing here put there
# The install rules of something else.
mkdir -p usr/include; echo x >usr/include/polygmap.hpp; chmod 755 usr/include; chmod 644 usr/include/polygmap.hpp
