// SPDX-License-Identifier: Apache-2.0
// expect: recursion: careless
struct Node {
  const Node* left;
  const Node* right;
  int value;
};
int careless(const Node* n) noexcept { return n == nullptr ? 0 : careless(n->left) * n->value - careless(n->right); }
