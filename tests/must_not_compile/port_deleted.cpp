// SPDX-License-Identifier: Apache-2.0
// Somebody else owns a port: nobody destroys it through its interface.
// expect: (is protected|protected destructor)
#include "hal/ports/imu.hpp"

#ifdef POSITIVE_CONTROL
void stop(polygmap::hal::Imu* imu, polygmap::ImuSample& sample) { (void)imu->try_read(sample); }
#else
void stop(polygmap::hal::Imu* imu) { delete imu; }
#endif
