// SPDX-License-Identifier: Apache-2.0
// expect: stack-use-after-scope
int main(int argc, char**) {
  int* volatile p = nullptr;
  {
    int gone = argc;
    p = &gone;
  }
  return *p;
}
