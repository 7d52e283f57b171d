// SPDX-License-Identifier: Apache-2.0
// The rig's button, lights and buzzer.
#pragma once

#include "common/result/result.h"
#include "device/session/live_status.h"
#include "device/session/operator_command.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace gyre {

// Parts that are not there have empty names. Lines are named as parse_line_name takes them, lights and the buzzer as
// Lamp::open does.
struct PanelOptions {
  std::string button;
  int debounce_ms = 20;
  std::string red, green, blue;  // of one light, or of as many as there are
  std::string buzzer;
  std::string ring;  // SPI port of WS2812 lights, "/dev/spidev0.0"
  int ring_lights = 24;
  double ring_brightness = 0.25;  // of what the lights can do, 0 to 1

  bool is_empty() const;
  Result<void> check() const;
};

// Button and lights have a thread each. A part that fails is left alone from then on, which the log says; the others
// go on.
class Panel {
 public:
  // Opens what is there; what cannot be opened is left out and said in `troubles`. press: called from a thread of the
  // panel for every press. options.check() must hold.
  Panel(const PanelOptions& options, std::function<void(OperatorCommand::Kind)> press, std::vector<Error>& troubles);
  // Lights and buzzer are off afterwards.
  ~Panel();
  Panel(const Panel&) = delete;
  Panel& operator=(const Panel&) = delete;

  // What is shown from now on. From any thread.
  void show(const LiveStatus& status);

 private:
  class Button;
  class Lights;
  std::unique_ptr<Button> button_;
  std::unique_ptr<Lights> lights_;
};

}  // namespace gyre
