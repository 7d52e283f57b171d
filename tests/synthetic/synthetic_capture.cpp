// SPDX-License-Identifier: Apache-2.0
// The program that makes a capture with exact truth: synthetic_capture OUT --sequence orbit-body
#include "tests/synthetic/write_capture.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

int main(int argc, char** argv) {
  using namespace gyre::synthetic;
  CLI::App app("Renders a synthetic person in a room and writes the pictures with their exact truth");
  CaptureOptions capture;
  WriteOptions write;
  std::filesystem::path out;
  const std::map<std::string, Sequence> sequences = {
      {"orbit-body", Sequence::orbit_body}, {"orbit-head", Sequence::orbit_head}, {"turn", Sequence::turn}};
  bool images = false, no_stop = false, no_rush = false;
  double height_mm = 1000 * capture.stature;
  app.add_option("out", out, "folder to write into")->required();
  app.add_option("--sequence", capture.sequence, "orbit-body, orbit-head or turn")
      ->transform(CLI::CheckedTransformer(sequences))
      ->default_str("orbit-body");
  app.add_option("--frames", capture.frames, "number of frames")->capture_default_str()->check(CLI::Range(2, 100000));
  app.add_option("--width", capture.width, "picture width, pixels")->capture_default_str()->check(CLI::Range(16, 8192));
  app.add_option("--height", capture.height, "picture height, pixels")
      ->capture_default_str()
      ->check(CLI::Range(16, 8192));
  app.add_option("--fps", capture.fps, "frames a second")->capture_default_str()->check(CLI::Range(1.0, 240.0));
  app.add_option("--height-mm", height_mm, "stature of the subject, mm")
      ->capture_default_str()
      ->check(CLI::Range(500.0, 2500.0));
  app.add_option("--noise", capture.noise, "sensor noise at mid grey, 8-bit levels")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 50.0));
  app.add_option("--exposure-drift", capture.exposure_drift, "largest change of gain, share of 1")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 0.9));
  app.add_option("--jitter-mm", capture.jitter_mm, "unsteadiness of the hand, mm")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 200.0));
  app.add_option("--sway-deg", capture.sway_deg, "largest lean of the subject, degrees")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 20.0));
  app.add_option("--defocus-px", capture.defocus_px, "radius of the focus hunt's blur, pixels")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 50.0));
  app.add_flag("--no-stop", no_stop, "the operator never stands still");
  app.add_flag("--no-rush", no_rush, "the operator never hurries");
  app.add_option("--samples", capture.samples, "rays along a pixel's side")
      ->capture_default_str()
      ->check(CLI::Range(1, 4));
  app.add_option("--seed", capture.seed, "seed of everything random")->capture_default_str();
  app.add_flag("--images", images, "JPEG pictures in frames/ instead of a video");
  CLI11_PARSE(app, argc, argv);
  capture.stature = height_mm / 1000;
  capture.stop = !no_stop;
  capture.rush = !no_rush;
  write.pictures = images ? PictureFormat::images : PictureFormat::video;
  if (auto written = write_capture(make_capture(capture), out, write); !written) {
    std::fprintf(stderr, "synthetic_capture: %s\n", written.error().message().c_str());
    return written.error().exit_code();
  }
  return 0;
}
