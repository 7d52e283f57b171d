// SPDX-License-Identifier: Apache-2.0
#include "device/panel/panel.h"

#include "device/panel/gpio.h"
#include "device/panel/lamp.h"
#include "device/panel/press.h"
#include "device/panel/ring.h"
#include "device/panel/shine.h"
#include "device/panel/spi.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

namespace gyre {

namespace {

using namespace std::chrono_literals;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

OperatorCommand::Kind command_of(Press press) {
  switch (press) {
    case Press::short_press:
      break;
    case Press::long_press:
      return OperatorCommand::Kind::cancel;
    case Press::very_long_press:
      return OperatorCommand::Kind::shut_down;
  }
  return OperatorCommand::Kind::press;
}

// A part that is tried until it fails.
template <class Part, class Do>
void use(std::optional<Part>& part, const Do& task) {
  if (!part) return;
  if (const Result<void> done = task(*part); !done) {
    spdlog::error("{}", done.error().message());
    part.reset();
  }
}

}  // namespace

class Panel::Button {
 public:
  Button(std::unique_ptr<InputLine> line, std::function<void(OperatorCommand::Kind)> press)
      : line_(std::move(line)), press_(std::move(press)), thread_(&Button::run, this) {}
  ~Button() {
    is_stopped_ = true;
    thread_.join();
  }
  Button(const Button&) = delete;
  Button& operator=(const Button&) = delete;

 private:
  void run() {
    PressClassifier classifier;
    while (!is_stopped_) {
      const Result<std::optional<LineEdge>> edge = line_->next(50ms);
      if (!edge) {
        spdlog::error("{}; the button no longer works", edge.error().message());
        return;
      }
      const std::optional<Press> press =
          *edge ? classifier.edge((*edge)->time, (*edge)->is_active) : classifier.wait(now_s());
      if (press) press_(command_of(*press));
    }
  }

  std::unique_ptr<InputLine> line_;
  std::function<void(OperatorCommand::Kind)> press_;
  std::atomic<bool> is_stopped_{false};
  std::thread thread_;
};

class Panel::Lights {
 public:
  Lights(const PanelOptions& options, std::vector<Error>& troubles)
      : ring_lights_(options.ring_lights), ring_brightness_(options.ring_brightness) {
    const std::array names = {&options.red, &options.green, &options.blue};
    for (std::size_t i = 0; i < names.size(); ++i) open(*names[i], colours_[i], troubles);
    open(options.buzzer, buzzer_, troubles);
    if (!options.ring.empty()) {
      Result<std::unique_ptr<SpiPort>> port = SpiPort::open(options.ring, ws2812_hertz);
      if (port) {
        ring_ = std::move(*port);
      } else {
        troubles.push_back(port.error());
      }
    }
    thread_ = std::thread(&Lights::run, this);
  }
  ~Lights() {
    {
      const std::lock_guard lock(mutex_);
      is_stopped_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  Lights(const Lights&) = delete;
  Lights& operator=(const Lights&) = delete;

  void show(const LiveStatus& status) {
    const std::lock_guard lock(mutex_);
    status_ = status;
  }

 private:
  static void open(const std::string& name, std::optional<Lamp>& lamp, std::vector<Error>& troubles) {
    if (name.empty()) return;
    Result<Lamp> opened = Lamp::open(name);
    if (opened) {
      lamp = std::move(*opened);
    } else {
      troubles.push_back(opened.error());
    }
  }

  void run() {
    constexpr std::chrono::milliseconds beat{40};
    std::optional<Signal> signal;
    double began = 0.0;
    std::unique_lock lock(mutex_);
    while (!is_stopped_) {
      const LiveStatus status = status_;
      lock.unlock();
      const double now = now_s();
      if (signal != status.signal) {
        signal = status.signal;
        began = now;
      }
      light(status, now - began);
      lock.lock();
      changed_.wait_for(lock, beat, [&] { return is_stopped_; });
    }
    lock.unlock();
    light(LiveStatus{}, 0.0);
  }

  void light(const LiveStatus& status, double time) {
    const double level = level_of(status.signal.pattern, time);
    const Rgb colour = dimmed(rgb_of(status.signal.colour), level);
    const std::array parts = {colour.red, colour.green, colour.blue};
    constexpr double full = 255.0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      use(colours_[i], [&](Lamp& lamp) { return lamp.shine(parts[i] / full); });
    }
    use(buzzer_, [&](Lamp& lamp) { return lamp.sound(frequency_of(status.signal.tone, time)); });
    if (!ring_) return;
    std::vector<Rgb> lights = ring_of(status, level, ring_lights_);
    for (Rgb& one : lights) one = dimmed(one, ring_brightness_);
    const std::vector<std::uint8_t> bytes = ws2812_bytes(lights);
    if (bytes == sent_) return;
    if (const Result<void> sent = ring_->send(bytes); !sent) {
      spdlog::error("{}; the ring no longer works", sent.error().message());
      ring_.reset();
    }
    sent_ = bytes;
  }

  int ring_lights_;
  double ring_brightness_;
  std::array<std::optional<Lamp>, 3> colours_;
  std::optional<Lamp> buzzer_;
  std::unique_ptr<SpiPort> ring_;
  std::vector<std::uint8_t> sent_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  LiveStatus status_;
  bool is_stopped_ = false;
  std::thread thread_;
};

bool PanelOptions::is_empty() const {
  return button.empty() && red.empty() && green.empty() && blue.empty() && buzzer.empty() && ring.empty();
}

Result<void> PanelOptions::check() const {
  if (!button.empty()) {
    if (const Result<LineName> line = parse_line_name(button); !line) return tl::unexpected(line.error());
  }
  for (const std::string* const name : {&red, &green, &blue, &buzzer}) {
    if (name->empty()) continue;
    if (const Result<void> valid = check_lamp_name(*name); !valid) return valid;
  }
  constexpr int most_lights = 400;  // that one transfer has room for
  if (ring_lights < 1 || ring_lights > most_lights) {
    return wrong_use("lights of the ring out of range", std::to_string(ring_lights), "1 to 400");
  }
  if (debounce_ms < 0 || debounce_ms > 1000) {
    return wrong_use("debounce time out of range", std::to_string(debounce_ms), "0 to 1000 ms");
  }
  if (!(ring_brightness >= 0.0 && ring_brightness <= 1.0)) return wrong_use("the ring's brightness is out of range");
  return {};
}

Panel::Panel(const PanelOptions& options, std::function<void(OperatorCommand::Kind)> press,
             std::vector<Error>& troubles) {
  if (!options.button.empty()) {
    Result<std::unique_ptr<InputLine>> line =
        open_input(*parse_line_name(options.button), std::chrono::milliseconds(options.debounce_ms));
    if (line) {
      button_ = std::make_unique<Button>(std::move(*line), std::move(press));
    } else {
      troubles.push_back(line.error());
    }
  }
  lights_ = std::make_unique<Lights>(options, troubles);
}

Panel::~Panel() = default;

void Panel::show(const LiveStatus& status) {
  lights_->show(status);
}

}  // namespace gyre
