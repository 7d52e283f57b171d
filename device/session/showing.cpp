// SPDX-License-Identifier: Apache-2.0
#include "device/session/showing.h"

#include "device/session/signals.h"

namespace gyre {

namespace {

constexpr double idle_every = 0.2;  // seconds

}  // namespace

void Showing::begin_pass(const std::string& pass, bool is_last_pass) {
  observer_.emplace(pass, is_last_pass);
  guidance_ = Guidance();
  seen_ = {};
  place_.reset();
  cells_ = {};
  frames_ = 0;
}

void Showing::idle_frame(double now, const cv::Mat& bgr) {
  rate_.frame(now);
  if (now - looked_at_ < idle_every) return;
  looked_at_ = now;
  seen_ = observe_idle(now, bgr);
}

void Showing::recorded_frame(double now, const PassRecorder& recorder) {
  rate_.frame(now);
  place_ = recorder.place();
  seen_ = observer_->add(recorder.reading(), place_, recorder.map());
  frames_ = recorder.frames();
  show_map(recorder.map());
}

void Showing::guide(double now, const Surroundings& around) {
  seen_.time = now;
  seen_.is_recording = around.is_recording;
  seen_.has_camera = around.has_camera;
  seen_.has_disk = around.has_disk;
  seen_.has_host = around.has_host;
  guidance_.update(seen_);
}

LiveStatus Showing::status(double now, SessionState state, const OpenScan& scan, const HostWatch& host) {
  LiveStatus status;
  status.state = state;
  if (scan.scan() && state != SessionState::idle) status.scan = scan.scan()->id;
  status.pass = scan.pass();
  status.signal = signal_of(state, guidance_);
  status.conditions = guidance_.conditions();
  if (place_) {
    if (place_->place.known) status.azimuth = place_->place.azimuth;
    status.band = place_->band;
  }
  status.cells = cells_;
  status.frames = frames_;
  status.keyframes = host.keyframes();
  status.acknowledged = host.acknowledged();
  status.frames_per_second = rate_.rate(now);
  status.host = host.status();
  return status;
}

void Showing::show_map(const CoverageMap& map) {
  for (const Band band : all_bands) {
    for (int sector = 0; sector < CoverageMap::sectors; ++sector) {
      const CoverageCell& cell = map.cell(band, sector);
      cells_[static_cast<std::size_t>(band)][static_cast<std::size_t>(sector)] = {cell.best_frame >= 0,
                                                                                  cell.is_covered(), cell.quality};
    }
  }
}

}  // namespace gyre
