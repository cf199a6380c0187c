// SPDX-License-Identifier: Apache-2.0
// expect: 'operator delete.*heap
struct Port {
  virtual ~Port() = default;
  virtual int read() noexcept = 0;
};
struct Camera final : Port {
  int read() noexcept override;
};
int Camera::read() noexcept { return 1; }
