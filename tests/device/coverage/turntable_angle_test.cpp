// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/turntable_angle.h"

#include <gtest/gtest.h>
#include <cmath>
#include <thread>

namespace gyre {
namespace {

constexpr double degree = M_PI / 180.0;

TEST(TurntableAngle, LiesOnTheLineBetweenTwoSamples) {
  TurntableAngle table;
  EXPECT_FALSE(table.at(0.0));
  table.add(10.0, 0.5);
  table.add(10.1, 0.7);
  EXPECT_DOUBLE_EQ(*table.at(10.0), 0.5);
  EXPECT_NEAR(*table.at(10.025), 0.55, 1e-12);
  EXPECT_DOUBLE_EQ(*table.at(10.1), 0.7);
}

TEST(TurntableAngle, IsNotWrappedWhicheverWayTheTableGoes) {
  for (const double way : {1.0, -1.0}) {
    TurntableAngle wrapped, whole;
    for (int i = 0; i <= 80; ++i) {
      const double angle = way * i * 10.0 * degree;
      wrapped.add(0.05 * i, std::remainder(angle, 2 * M_PI));
      whole.add(0.05 * i, angle);
    }
    for (double time = 0.0; time <= 4.0; time += 0.013) {
      EXPECT_NEAR(*whole.at(time), way * 200.0 * degree * time, 1e-9);
      EXPECT_NEAR(*wrapped.at(time), *whole.at(time), 1e-9);
    }
  }
}

TEST(TurntableAngle, TellsNothingOutsideOfTheSamplesNorInAGap) {
  TurntableAngleOptions options;
  TurntableAngle table(options);
  table.add(1.0, 0.0);
  EXPECT_FALSE(table.at(1.01)) << "one sample tells no rate";
  table.add(1.1, 0.1);
  EXPECT_FALSE(table.at(0.99));
  EXPECT_FALSE(table.at(1.1 + options.ahead + 0.01));
  const double after = 1.1 + options.longest_gap + 0.05;
  table.add(after, 0.2);
  EXPECT_FALSE(table.at(1.2));
  EXPECT_TRUE(table.at(after));
  EXPECT_FALSE(table.at(after + 0.01)) << "nor does one after a gap";
  EXPECT_NEAR(*table.at(1.05), 0.05, 1e-12);
}

TEST(TurntableAngle, GoesOnAsItWentForAMoment) {
  TurntableAngle table;
  for (int i = 0; i <= 10; ++i) table.add(0.05 * i, 0.3 * 0.05 * i);
  EXPECT_NEAR(*table.at(0.58), 0.3 * 0.58, 1e-12);
}

TEST(TurntableAngle, WhatComesLateOrIsLongPastIsLeftOut) {
  TurntableAngleOptions options;
  options.memory = 1.0;
  TurntableAngle table(options);
  for (int i = 0; i <= 40; ++i) table.add(0.05 * i, 0.01 * i);
  table.add(1.9, 3.0);
  table.add(2.0, 3.0);
  EXPECT_NEAR(*table.at(1.975), 0.395, 1e-12);
  EXPECT_FALSE(table.at(0.9));
  EXPECT_TRUE(table.at(1.1));
}

TEST(TurntableAngle, IsAskedWhileSamplesComeIn) {
  TurntableAngle table;
  table.add(0.0, 0.0);
  std::thread line([&] {
    for (int i = 1; i <= 2000; ++i) table.add(1e-3 * i, 2e-3 * i);
  });
  for (int i = 0; i < 2000; ++i) {
    const std::optional<double> angle = table.at(5e-4 * i);
    if (angle) {
      EXPECT_NEAR(*angle, 1e-3 * i, 1e-9);
    }
  }
  line.join();
  EXPECT_NEAR(*table.at(1.9995), 3.999, 1e-9);
}

}  // namespace
}  // namespace gyre
