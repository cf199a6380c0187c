// SPDX-License-Identifier: Apache-2.0
// Never compiles: a snippet that fails whatever one does shows nothing.
// expect: undeclared
int value = undeclared;
