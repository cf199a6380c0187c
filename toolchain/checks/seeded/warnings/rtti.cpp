// SPDX-License-Identifier: Apache-2.0
// expect: rtti
struct A {
  virtual void f();
};
struct B : A {};
B* careless(A* a) { return dynamic_cast<B*>(a); }
