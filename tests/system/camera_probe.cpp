// SPDX-License-Identifier: Apache-2.0
// Takes frames from a camera by its name, as the device does, and says what came: one JSON line a frame, then one with
// the counters. camera_probe CAMERA FRAMES [lock]; gives up after 60 seconds without a frame.
#include "common/bundle/sha256.h"
#include "common/log/log.h"
#include "common/selection/ingest.h"
#include "device/camera/camera_device.h"

#include <sys/resource.h>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

namespace gyre {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

void say(const json& line) {
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
}

int fail_with(const Error& error) {
  say({{"error", error.message()}});
  return error.exit_code();
}

json to_json(const Frame& frame) {
  const Result<std::string> jpeg = keyframe_jpeg(frame);
  json line = {{"index", frame.index},
               {"time", frame.time},
               {"sha256", jpeg ? sha256(*jpeg) : jpeg.error().message()},
               {"width", frame.image.cols},
               {"height", frame.image.rows}};
  if (frame.settings.exposure_s) line["exposure_s"] = *frame.settings.exposure_s;
  if (frame.settings.gain) line["gain"] = *frame.settings.gain;
  return line;
}

int probe(const std::string& name, int frames, bool lock) {
  constexpr int most_timeouts = 60;
  Result<std::unique_ptr<CameraDevice>> opened = open_camera(name, Pace::fast);
  if (!opened) return fail_with(opened.error());
  CameraDevice& camera = **opened;
  if (const Result<void> started = camera.start(); !started) return fail_with(started.error());
  if (lock) camera.lock(500ms);
  int timeouts = 0;
  for (int taken = 0; taken < frames;) {
    const Result<CameraEvent> event = camera.next(1s);
    if (!event) return fail_with(event.error());
    if (event->kind == CameraEvent::Kind::ended) break;
    if (event->kind == CameraEvent::Kind::timeout) {
      if (++timeouts > most_timeouts) return fail_with({"no frames", name, ""});
      say({{"timeout", event->recovering}});
      continue;
    }
    ++taken;
    say(to_json(*event->frame));
  }
  camera.stop();
  const CameraCounters counters = camera.counters();
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  say({{"queued", counters.queued},
       {"completed", counters.completed},
       {"cancelled", counters.cancelled},
       {"torn", counters.torn},
       {"missed", counters.missed},
       {"stray", counters.stray},
       {"restarts", counters.restarts},
       {"reopenings", counters.reopenings},
       {"clock_offset", camera.clock_offset().value_or(-1.0)},
       {"held", camera.locked() == CameraLock::held},
       {"width", camera.info().width},
       {"height", camera.info().height},
       {"peak_kib", usage.ru_maxrss}});
  return 0;
}

}  // namespace
}  // namespace gyre

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: camera_probe CAMERA FRAMES [lock]\n");
    return 2;
  }
  gyre::start_logging("camera_probe", "info");
  return gyre::probe(argv[1], std::atoi(argv[2]), argc > 3 && std::string(argv[3]) == "lock");
}
