// SPDX-License-Identifier: Apache-2.0
#include "device/panel/ring.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(Ring, BytesAreTheBitsOnTheWire) {
  const std::vector<Rgb> lights = {{0x00, 0xff, 0x80}};
  const std::vector<std::uint8_t> bytes = ws2812_bytes(lights);
  // Green, red, blue: a one is 110, a zero 100.
  const std::vector<std::uint8_t> expected = {0xdb, 0x6d, 0xb6, 0x92, 0x49, 0x24, 0xd2, 0x49, 0x24};
  ASSERT_EQ(bytes.size(), 9U + 90U);
  EXPECT_EQ(std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + 9), expected);
  for (std::size_t i = 9; i < bytes.size(); ++i) EXPECT_EQ(bytes[i], 0);
  // The pause is as long as the lights want it.
  EXPECT_GE(90.0 * 8.0 / ws2812_hertz, 280e-6);
}

TEST(Ring, EveryColourCanBeReadBack) {
  std::vector<Rgb> lights;
  for (int i = 0; i < 256; ++i) {
    lights.push_back(
        {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(255 - i), static_cast<std::uint8_t>(i * 7)});
  }
  const std::vector<std::uint8_t> bytes = ws2812_bytes(lights);
  std::size_t bit = 0;
  const auto wire_bit = [&] {
    const int value = bytes[bit / 8] >> (7 - bit % 8) & 1;
    ++bit;
    return value;
  };
  const auto value = [&] {
    int read = 0;
    for (int i = 0; i < 8; ++i) {
      EXPECT_EQ(wire_bit(), 1);
      read = 2 * read + wire_bit();
      EXPECT_EQ(wire_bit(), 0);
    }
    return static_cast<std::uint8_t>(read);
  };
  for (const Rgb& light : lights) {
    const std::uint8_t green = value(), red = value(), blue = value();
    EXPECT_EQ((Rgb{red, green, blue}), light);
  }
}

TEST(Ring, ShowsTheSectorsOfThePassThatIsOn) {
  LiveStatus status;
  status.state = SessionState::pass;
  status.band = Band::body_lower;
  status.azimuth = -M_PI / 2.0;  // three quarters around
  auto& cells = status.cells[static_cast<std::size_t>(Band::body_lower)];
  cells[0] = {true, true, 1.0};
  cells[1] = {true, true, 0.5};
  cells[2] = {true, false, 0.2};
  const std::vector<Rgb> lights = ring_of(status, 1.0, 24);
  ASSERT_EQ(lights.size(), 24U);
  EXPECT_EQ(lights[0], (Rgb{0, 255, 0}));
  EXPECT_GT(lights[0].green, lights[1].green);
  EXPECT_GT(lights[1].green, 0);
  EXPECT_GT(lights[2].red, 0);
  EXPECT_EQ(lights[3], Rgb{});
  EXPECT_EQ(lights[18], (Rgb{255, 255, 255}));
  // Rings of other sizes show the same.
  const std::vector<Rgb> few = ring_of(status, 1.0, 8);
  EXPECT_EQ(few[0], (Rgb{0, 255, 0}));
  EXPECT_EQ(few[6], (Rgb{255, 255, 255}));
  EXPECT_EQ(ring_of(status, 1.0, 48).size(), 48U);
}

TEST(Ring, OtherwiseShowsTheSignal) {
  LiveStatus status;
  status.signal.colour = Colour::blue;
  for (const Rgb& light : ring_of(status, 1.0, 12)) EXPECT_EQ(light, (Rgb{0, 0, 255}));
  for (const Rgb& light : ring_of(status, 0.0, 12)) EXPECT_EQ(light, Rgb{});
}

}  // namespace
}  // namespace gyre
