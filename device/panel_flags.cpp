// SPDX-License-Identifier: Apache-2.0
#include "device/panel_flags.h"

#include <CLI/CLI.hpp>

namespace gyre {

void add_panel_flags(CLI::App& verb, PanelOptions& options) {
  const std::string line = "GPIO line, by its NAME or as LABEL:OFFSET, with ! when it is active low";
  const std::string lamp = line + "; or pwm:DEVICE:CHANNEL";
  verb.add_option("--button", options.button, "the button's " + line + "; default: none");
  verb.add_option("--debounce-ms", options.debounce_ms, "how long the button's line has to be quiet, milliseconds")
      ->capture_default_str();
  verb.add_option("--red", options.red, "the red light's " + lamp + "; default: none");
  verb.add_option("--green", options.green, "the green light's " + lamp + "; default: none");
  verb.add_option("--blue", options.blue, "the blue light's " + lamp + "; default: none");
  verb.add_option("--buzzer", options.buzzer, "the buzzer's " + lamp + "; default: none");
  verb.add_option("--ring", options.ring, "SPI port of a ring of WS2812 lights, /dev/spidev0.0; default: none");
  verb.add_option("--ring-lights", options.ring_lights, "lights in the ring")->capture_default_str();
  verb.add_option("--ring-brightness", options.ring_brightness, "of what the ring can do, 0 to 1")
      ->capture_default_str();
}

}  // namespace gyre
