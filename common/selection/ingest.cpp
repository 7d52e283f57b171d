// SPDX-License-Identifier: Apache-2.0
#include "common/selection/ingest.h"

#include "common/bundle/atomic_file.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>

namespace gyre {

namespace {

// Progress through a source whose length is only claimed by its container.
void report(const Progress& progress, int done, const CaptureInfo& info, std::string_view what) {
  if (info.expected_frames > 0) progress(std::min(1.0, static_cast<double>(done) / info.expected_frames), what);
}

// A capture whose reading somebody may end.
class CancellableSource : public FrameSource {
 public:
  CancellableSource(std::unique_ptr<FrameSource> source, const std::atomic<bool>& cancel)
      : source_(std::move(source)), cancel_(cancel) {}
  const CaptureInfo& info() const override { return source_->info(); }
  Result<std::optional<Frame>> next() override {
    if (cancel_) return fail("cancelled", info().path.string());
    return source_->next();
  }

 private:
  std::unique_ptr<FrameSource> source_;
  const std::atomic<bool>& cancel_;
};

Result<std::unique_ptr<FrameSource>> open_cancellable(const std::filesystem::path& capture,
                                                      const std::atomic<bool>& cancel) {
  Result<std::unique_ptr<FrameSource>> source = open_capture(capture);
  if (!source) return source;
  return std::make_unique<CancellableSource>(std::move(*source), cancel);
}

Result<void> write_keyframes(const std::filesystem::path& capture, const std::string& pass, const Bundle& bundle,
                             const std::vector<int>& keyframes, const Progress& progress,
                             const std::atomic<bool>& cancel) {
  Result<std::unique_ptr<FrameSource>> source = open_cancellable(capture, cancel);
  if (!source) return tl::unexpected(source.error());
  for (const int wanted : keyframes) {
    for (;;) {
      const Result<std::optional<Frame>> frame = (*source)->next();
      if (!frame) return tl::unexpected(frame.error());
      if (!*frame) return fail("the capture changed while it was read", capture.string(), "run again");
      if ((*frame)->index < wanted) continue;
      const Result<std::string> jpeg = keyframe_jpeg(**frame);
      if (!jpeg) return tl::unexpected(jpeg.error());
      if (const auto written = write_file(bundle.frame(pass, wanted), *jpeg); !written) return written;
      report(progress, wanted, (*source)->info(), "writing keyframes");
      break;
    }
  }
  return {};
}

}  // namespace

Result<std::vector<MeasuredFrame>> measure_frames(FrameSource& source, const Progress& progress) {
  FrameMeter meter;
  std::vector<MeasuredFrame> frames;
  for (;;) {
    const Result<std::optional<Frame>> frame = source.next();
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) return frames;
    frames.push_back({(*frame)->time, meter.measure((*frame)->image), (*frame)->settings});
    report(progress, static_cast<int>(frames.size()), source.info(), "measuring frames");
  }
}

bool is_photographs(const CaptureInfo& info) {
  constexpr int most_photographs = 150;
  return info.pictures && info.expected_frames <= most_photographs;
}

Result<MeasuredSelection> select_keyframes(FrameSource& source, const SelectionOptions& options,
                                           const Progress& progress) {
  Result<std::vector<MeasuredFrame>> frames = measure_frames(source, progress);
  if (!frames) return tl::unexpected(frames.error());
  std::vector<FrameMeasure> measures;
  measures.reserve(frames->size());
  for (const MeasuredFrame& frame : *frames) measures.push_back(frame.measure);

  Result<Selection> selection =
      is_photographs(source.info()) ? keep_all(measures) : select_keyframes(measures, options);
  if (!selection) {
    if (selection.error().kind == Error::Kind::failed) {
      selection.error().where = source.info().path.string() + ", " + selection.error().where;
    }
    return tl::unexpected(selection.error());
  }
  return MeasuredSelection{std::move(*frames), std::move(*selection)};
}

std::vector<FrameRecord> frame_records(const std::string& pass, std::span<const MeasuredFrame> frames,
                                       const Selection& selection) {
  // The record holds the movement towards the next frame, as the paper counts it; a measure that from the one before.
  std::vector<FrameRecord> records;
  records.reserve(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t next = std::min(i + 1, frames.size() - 1);
    FrameRecord record;
    record.pass = pass;
    record.index = static_cast<int>(i);
    record.time = frames[i].time;
    record.motion = frames[next].measure.motion;
    record.smoothed_motion = selection.smoothed[next];
    record.sharpness = frames[i].measure.sharpness;
    record.exposure_s = frames[i].settings.exposure_s;
    record.gain = frames[i].settings.gain;
    record.lens_position = frames[i].settings.lens_position;
    record.decision = selection.decisions[i].keyframe ? "keyframe" : "skipped";
    record.reason = selection.decisions[i].reason;
    records.push_back(std::move(record));
  }
  return records;
}

Result<std::string> keyframe_jpeg(const Frame& frame) {
  if (!frame.jpeg.empty()) return frame.jpeg;
  if (frame.full) return frame.full->jpeg();
  std::vector<unsigned char> bytes;
  try {
    if (cv::imencode(".jpg", frame.image, bytes, {cv::IMWRITE_JPEG_QUALITY, keyframe_quality})) {
      return std::string(bytes.begin(), bytes.end());
    }
  } catch (const cv::Exception&) {
    bytes.clear();
  }
  return fail("cannot compress frame as JPEG", std::to_string(frame.index));
}

Result<IngestedPass> ingest_capture(const std::filesystem::path& capture, const std::string& pass, const Bundle& bundle,
                                    const SelectionOptions& options, const Progress& progress,
                                    const std::atomic<bool>& cancel) {
  Result<std::unique_ptr<FrameSource>> source = open_cancellable(capture, cancel);
  if (!source) return tl::unexpected(source.error());
  const CaptureInfo info = (*source)->info();
  constexpr double measuring = 0.8;  // of the time
  const Result<MeasuredSelection> measured = select_keyframes(
      **source, options, [&](double fraction, std::string_view what) { progress(measuring * fraction, what); });
  if (!measured) return tl::unexpected(measured.error());
  source->reset();

  const std::vector<int>& keyframes = measured->selection.keyframes;
  const Result<void> written = write_keyframes(
      capture, pass, bundle, keyframes,
      [&](double fraction, std::string_view what) { progress(measuring + (1.0 - measuring) * fraction, what); },
      cancel);
  if (!written) return tl::unexpected(written.error());

  IngestedPass out;
  const auto frames = static_cast<int>(measured->frames.size());
  out.pass = {pass, info.fps, frames, info.width, info.height, info.focal_35mm};
  out.records = frame_records(pass, measured->frames, measured->selection);
  out.keyframes = static_cast<int>(keyframes.size());
  return out;
}

}  // namespace gyre
