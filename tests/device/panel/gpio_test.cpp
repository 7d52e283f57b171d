// SPDX-License-Identifier: Apache-2.0
// Names of lines; real ones are tried in tests/system/panel_guest_test.cpp.
#include "device/panel/gpio.h"

#include "device/panel/lamp.h"
#include "device/panel/panel.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(Gpio, LinesAreNamedByNameOrByTheirChipsLabel) {
  const Result<LineName> by_name = parse_line_name("GYRE_BUTTON");
  ASSERT_TRUE(by_name);
  EXPECT_EQ(by_name->line, "GYRE_BUTTON");
  EXPECT_TRUE(by_name->chip.empty());
  EXPECT_FALSE(by_name->is_active_low);
  const Result<LineName> by_label = parse_line_name("!pinctrl-bcm2711:17");
  ASSERT_TRUE(by_label);
  EXPECT_EQ(by_label->chip, "pinctrl-bcm2711");
  EXPECT_EQ(by_label->line, "17");
  EXPECT_TRUE(by_label->is_active_low);
}

TEST(Gpio, NumbersThatChangeFromBootToBootAreRefused) {
  for (const char* const bad : {"", "!", "17", "gpiochip0:17", "0:17", "label:", ":3", "label:x", "label:1234567"}) {
    const Result<LineName> name = parse_line_name(bad);
    ASSERT_FALSE(name) << bad;
    EXPECT_EQ(name.error().exit_code(), 2) << bad;
    EXPECT_FALSE(name.error().remedy.empty()) << bad;
  }
  EXPECT_NE(parse_line_name("gpiochip0:17").error().message().find("label"), std::string::npos);
}

TEST(Gpio, ALineThatIsNotThereIsAnErrorThatNamesIt) {
  const auto input = open_input({"", "GYRE_NO_SUCH_LINE"}, std::chrono::milliseconds(10));
  ASSERT_FALSE(input);
  EXPECT_NE(input.error().message().find("GYRE_NO_SUCH_LINE"), std::string::npos) << input.error().message();
  EXPECT_FALSE(open_output({"no-such-chip", "3"}));
}

TEST(Panel, OptionsAreChecked) {
  EXPECT_TRUE(PanelOptions{}.check());
  EXPECT_TRUE(PanelOptions{}.is_empty());
  PanelOptions good;
  good.button = "!BUTTON";
  good.red = "pwm:fe20c000.pwm:0";
  good.buzzer = "panel:3";
  EXPECT_TRUE(good.check());
  EXPECT_FALSE(good.is_empty());
  const auto is_wrong = [&](const auto& change) {
    PanelOptions options = good;
    change(options);
    return !options.check();
  };
  EXPECT_TRUE(is_wrong([](PanelOptions& o) { o.button = "17"; }));
  EXPECT_TRUE(is_wrong([](PanelOptions& o) { o.green = "pwm:x"; }));
  EXPECT_TRUE(is_wrong([](PanelOptions& o) { o.debounce_ms = -1; }));
  EXPECT_TRUE(is_wrong([](PanelOptions& o) { o.ring_lights = 0; }));
  EXPECT_TRUE(is_wrong([](PanelOptions& o) { o.ring_brightness = 1.5; }));
}

TEST(Panel, WithoutItsPartsItSaysWhichAndTakesWhatIsShown) {
  PanelOptions options;
  options.button = "GYRE_NO_SUCH_BUTTON";
  options.red = "GYRE_NO_SUCH_LIGHT";
  options.ring = "/dev/gyre-no-such-port";
  std::vector<Error> troubles;
  Panel panel(
      options, [](OperatorCommand::Kind) {}, troubles);
  EXPECT_EQ(troubles.size(), 3U);
  panel.show({});
}

}  // namespace
}  // namespace gyre
