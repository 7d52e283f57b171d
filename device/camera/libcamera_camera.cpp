// SPDX-License-Identifier: Apache-2.0
#include "device/camera/libcamera_camera.h"

#include "device/camera/encode_pool.h"
#include "device/camera/jpeg.h"
#include "device/camera/libcamera_shim.h"
#include "device/camera/sensor_clock.h"
#include "device/camera/settle_watch.h"

#include <libcamera/libcamera.h>
#include <linux/dma-buf.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <opencv2/core.hpp>
#include <utility>

namespace gyre {

namespace {

namespace lc = libcamera;
namespace ids = libcamera::controls;

// There can be one manager in a process. It goes with the last camera, so that a camera that is opened again is looked
// for anew.
Result<std::shared_ptr<lc::CameraManager>> manager() {
  static std::mutex mutex;
  static std::weak_ptr<lc::CameraManager> shared;
  const std::scoped_lock lock(mutex);
  if (auto there = shared.lock()) return there;
  std::shared_ptr<lc::CameraManager> made(new lc::CameraManager, [](lc::CameraManager* old) {
    old->stop();
    delete old;
  });
  if (const int error = made->start(); error != 0) return fail("libcamera does not start", std::strerror(-error));
  shared = made;
  return made;
}

// How a stream's pictures are read. libcamera names pixels as the kernel does, by words: BGR888 is R, G, B in bytes.
struct Readable {
  lc::PixelFormat format;
  std::optional<RawPicture::Format> raw;  // nothing: JPEG
};
const std::array<Readable, 6>& readable_formats() {
  static const std::array<Readable, 6> formats = {{{lc::formats::MJPEG, std::nullopt},
                                                   {lc::formats::YUV420, RawPicture::Format::i420},
                                                   {lc::formats::NV12, RawPicture::Format::nv12},
                                                   {lc::formats::YUYV, RawPicture::Format::yuyv},
                                                   {lc::formats::BGR888, RawPicture::Format::rgb},
                                                   {lc::formats::RGB888, RawPicture::Format::bgr}}};
  return formats;
}

const Readable* readable(const lc::PixelFormat& format) {
  const auto& formats = readable_formats();
  const auto* const found =
      std::find_if(formats.begin(), formats.end(), [&](const Readable& known) { return known.format == format; });
  return found == formats.end() ? nullptr : found;
}

// Gives a stream the first of these formats that it has, and a size near the wanted one.
bool choose_format(lc::StreamConfiguration& stream, const lc::Size& wanted, bool raw) {
  const std::vector<lc::PixelFormat> offered = stream.formats().pixelformats();
  for (const Readable& known : readable_formats()) {
    if (raw && !known.raw) continue;
    if (!offered.empty() && std::find(offered.begin(), offered.end(), known.format) == offered.end()) continue;
    stream.pixelFormat = known.format;
    stream.size = wanted;
    const auto distance = [&](const lc::Size& size) {
      return std::abs(static_cast<double>(size.width) - wanted.width) +
             std::abs(static_cast<double>(size.height) - wanted.height);
    };
    const lc::SizeRange range = stream.formats().range(known.format);
    const std::vector<lc::Size> sizes = stream.formats().sizes(known.format);
    if (!sizes.empty() && !range.contains(wanted)) {
      stream.size = *std::min_element(sizes.begin(), sizes.end(),
                                      [&](const lc::Size& a, const lc::Size& b) { return distance(a) < distance(b); });
    }
    return true;
  }
  return false;
}

// Memory of a frame buffer, mapped as long as this lives.
class MappedBuffer {
 public:
  explicit MappedBuffer(const lc::FrameBuffer& buffer) {
    std::map<int, std::size_t> lengths;
    for (const lc::FrameBuffer::Plane& plane : buffer.planes()) {
      std::size_t& length = lengths[plane.fd.get()];
      length = std::max<std::size_t>(length, plane.offset + plane.length);
    }
    for (const auto& [fd, length] : lengths) {
      void* const start = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, fd, 0);
      if (start != MAP_FAILED) areas_[fd] = {static_cast<const std::uint8_t*>(start), length};
    }
    for (const lc::FrameBuffer::Plane& plane : buffer.planes()) {
      const auto area = areas_.find(plane.fd.get());
      if (area == areas_.end()) continue;
      planes_.push_back(area->second.subspan(plane.offset, plane.length));
    }
    whole_ = planes_.size() == buffer.planes().size();
  }
  MappedBuffer(const MappedBuffer&) = delete;
  MappedBuffer& operator=(const MappedBuffer&) = delete;
  ~MappedBuffer() {
    for (const auto& [fd, area] : areas_) ::munmap(const_cast<std::uint8_t*>(area.data()), area.size());
  }

  bool whole() const { return whole_; }
  const std::vector<std::span<const std::uint8_t>>& planes() const { return planes_; }

  // Around reading, so that the processor sees what the camera wrote. Memory that needs none of it says so.
  void begin_read() const { sync(DMA_BUF_SYNC_START); }
  void end_read() const { sync(DMA_BUF_SYNC_END); }

 private:
  void sync(std::uint64_t when) const {
    for (const auto& [fd, area] : areas_) {
      dma_buf_sync what{.flags = when | DMA_BUF_SYNC_READ};
      ::ioctl(fd, DMA_BUF_IOCTL_SYNC, &what);
    }
  }

  std::map<int, std::span<const std::uint8_t>> areas_;  // by file descriptor
  std::vector<std::span<const std::uint8_t>> planes_;
  bool whole_ = false;
};

// The picture in a buffer without what pads its rows; too short when the buffer is.
RawPicture copy_raw(const MappedBuffer& buffer, const lc::StreamConfiguration& stream, RawPicture::Format format) {
  RawPicture raw{.format = format,
                 .width = static_cast<int>(stream.size.width),
                 .height = static_cast<int>(stream.size.height),
                 .bytes = {}};
  raw.bytes.reserve(raw_bytes(format, raw.width, raw.height));
  struct Part {
    std::size_t row, stride, rows;
  };
  const std::size_t width = stream.size.width;
  const std::size_t height = stream.size.height;
  const std::size_t stride = stream.stride;
  std::vector<Part> parts;
  switch (format) {
    case RawPicture::Format::i420:
      parts = {{width, stride, height}, {width / 2, stride / 2, height / 2}, {width / 2, stride / 2, height / 2}};
      break;
    case RawPicture::Format::nv12:
      parts = {{width, stride, height}, {width, stride, height / 2}};
      break;
    case RawPicture::Format::yuyv:
      parts = {{2 * width, stride, height}};
      break;
    default:
      parts = {{3 * width, stride, height}};
      break;
  }
  // Planes of their own, or one after the other in one.
  const bool apart = buffer.planes().size() == parts.size();
  std::size_t at = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    const std::span<const std::uint8_t> plane = buffer.planes()[apart ? i : 0];
    if (apart) at = 0;
    const std::size_t step = std::max(part.stride, part.row);
    for (std::size_t y = 0; y < part.rows && at + part.row <= plane.size(); ++y, at += step) {
      const auto row = plane.subspan(at, part.row);
      raw.bytes.insert(raw.bytes.end(), row.begin(), row.end());
    }
  }
  return raw;
}

// What libcamera's thread tells. Its call-backs only write down and never wait.
class Arrivals {
 public:
  void expect(std::size_t requests) { queued_.assign(requests, false); }

  // Before the request is queued: it may be back before queueRequest() is.
  void queued(std::uint64_t request) {
    const std::scoped_lock lock(mutex_);
    queued_[request] = true;
    ++counters_.queued;
  }

  void refused(std::uint64_t request) {
    const std::scoped_lock lock(mutex_);
    queued_[request] = false;
    --counters_.queued;
  }

  void completed(lc::Request* request) {
    {
      const std::scoped_lock lock(mutex_);
      if (!queued_[request->cookie()]) ++counters_.stray;
      queued_[request->cookie()] = false;
      if (request->status() == lc::Request::RequestCancelled) {
        ++counters_.cancelled;
        cancelled_ = true;
      } else {
        ++counters_.completed;
        done_.push_back(request);
      }
    }
    changed_.notify_one();
  }

  void disconnected() {
    {
      const std::scoped_lock lock(mutex_);
      gone_ = true;
    }
    changed_.notify_one();
  }

  // The next request that came back with pictures; nothing when none did in time. Errors: the camera is gone, or its
  // requests came back without pictures, which is how a stream breaks.
  Result<lc::Request*> next(std::chrono::steady_clock::time_point until, const std::string& name) {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait_until(lock, until, [&] { return gone_ || cancelled_ || !done_.empty(); });
    if (gone_) return fail("the device is gone", name, "plug it in again");
    if (done_.empty() && cancelled_) return fail("the stream is broken", name);
    if (done_.empty()) return nullptr;
    lc::Request* const request = done_.front();
    done_.pop_front();
    return request;
  }

  // The stream was stopped, and everything is back.
  void clear() {
    const std::scoped_lock lock(mutex_);
    done_.clear();
    cancelled_ = false;
  }

  // Nothing will come back any more.
  void write_off() {
    const std::scoped_lock lock(mutex_);
    counters_.cancelled += std::count(queued_.begin(), queued_.end(), true);
    std::fill(queued_.begin(), queued_.end(), false);
    gone_ = true;
  }

  bool gone() const {
    const std::scoped_lock lock(mutex_);
    return gone_;
  }

  CameraCounters counters() const {
    const std::scoped_lock lock(mutex_);
    return counters_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<lc::Request*> done_;
  std::vector<bool> queued_;  // by request
  CameraCounters counters_;
  bool cancelled_ = false;
  bool gone_ = false;
};

// All that belongs to libcamera of an opened camera.
struct Opened {
  std::shared_ptr<lc::CameraManager> keeper;
  std::shared_ptr<lc::Camera> camera;
  bool acquired = false;
  std::unique_ptr<lc::CameraConfiguration> configuration;  // the main stream, then the one for analysis
  std::unique_ptr<lc::FrameBufferAllocator> allocator;
  std::map<const lc::FrameBuffer*, std::unique_ptr<MappedBuffer>> buffers;
  std::vector<std::unique_ptr<lc::Request>> requests;
  Arrivals arrivals;

  Opened(std::shared_ptr<lc::CameraManager> manager, std::shared_ptr<lc::Camera> found)
      : keeper(std::move(manager)), camera(std::move(found)) {}
  Opened(const Opened&) = delete;
  Opened& operator=(const Opened&) = delete;
  // Not while it streams.
  ~Opened() {
    if (!acquired) return;
    camera->requestCompleted.disconnect(&arrivals);
    camera->disconnected.disconnect(&arrivals);
    requests.clear();
    buffers.clear();
    allocator.reset();
    configuration.reset();
    camera->release();
  }

  // Without its device nodes a camera is gone, whether libcamera has heard of it or not.
  bool gone() const {
    if (arrivals.gone()) return true;
    const auto devices = camera->properties().get(lc::properties::SystemDevices);
    if (!devices) return false;
    return std::any_of(devices->begin(), devices->end(), [](std::int64_t device) {
      const auto number = static_cast<dev_t>(device);
      const std::string node = std::to_string(major(number)) + ":" + std::to_string(minor(number));
      return ::access(("/sys/dev/char/" + node).c_str(), F_OK) != 0;
    });
  }
};

// libcamera (0.3.2) ends the program when a camera that is gone is stopped, since its requests do not come back. So
// what belongs to it stays as it is until the program ends; a camera that is plugged in again is a new one.
void abandon(std::unique_ptr<Opened> opened) {
  static auto* const abandoned = new std::vector<std::unique_ptr<Opened>>;
  opened->arrivals.write_off();
  abandoned->push_back(std::move(opened));
}

class LibcameraCamera : public CameraDevice {
 public:
  LibcameraCamera(std::shared_ptr<lc::CameraManager> keeper, std::shared_ptr<lc::Camera> camera)
      : opened_(std::make_unique<Opened>(std::move(keeper), std::move(camera))) {}

  ~LibcameraCamera() override { stop(); }

  Result<void> open(const CameraName& name) {
    lc::Camera& camera = *opened_->camera;
    if (const int error = camera.acquire(); error != 0)
      return fail("the camera cannot be had", camera.id() + " (" + std::strerror(-error) + ")",
                  "end the other program that uses it");
    opened_->acquired = true;
    camera.requestCompleted.connect(&opened_->arrivals, &Arrivals::completed);
    camera.disconnected.connect(&opened_->arrivals, &Arrivals::disconnected);
    if (const Result<void> configured = configure(name); !configured) return configured;
    if (const Result<void> allocated = allocate(); !allocated) return allocated;
    info_.name = "libcamera:" + camera.id();
    info_.width = static_cast<int>(main().size.width);
    info_.height = static_cast<int>(main().size.height);
    info_.fps = fps();
    info_.live = true;
    return {};
  }

  const CameraInfo& info() const override { return info_; }

  Result<void> start() override {
    if (started_) return {};
    if (!opened_ || opened_->gone()) return fail("the device is gone", info_.name, "plug it in again");
    count_ = 0;
    first_stamp_.reset();
    last_sequence_.reset();
    clock_.restart();
    settle_.restart();
    lc::ControlList controls(camera().controls());
    if (held_) controls.merge(*held_);
    if (const int error = camera().start(&controls); error != 0)
      return fail("the stream does not start", info_.name + " (" + std::strerror(-error) + ")");
    started_ = true;
    for (const auto& request : opened_->requests) {
      request->reuse(lc::Request::ReuseBuffers);
      if (const Result<void> queued = queue(*request); !queued) {
        stop();
        return queued;
      }
    }
    return {};
  }

  // libcamera hands back all requests before this returns.
  void stop() override {
    if (!std::exchange(started_, false)) return;
    if (opened_->gone()) {
      opened_->arrivals.write_off();
      counters_ = counters();
      abandon(std::move(opened_));
      return;
    }
    camera().stop();
    opened_->arrivals.clear();
  }

  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    if (!started_) return fail("the camera is not started", info_.name);
    const auto until = std::chrono::steady_clock::now() + timeout;
    for (;;) {
      const Result<lc::Request*> arrived = opened_->arrivals.next(until, info_.name);
      if (!arrived) return tl::unexpected(arrived.error());
      if (*arrived == nullptr) return CameraEvent{};
      lc::Request& request = **arrived;
      std::optional<Frame> frame = take(request);
      if (frame) hold_when_settled(*frame, request.metadata());
      request.reuse(lc::Request::ReuseBuffers);
      if (next_controls_) request.controls().merge(*std::exchange(next_controls_, std::nullopt));
      if (const Result<void> queued = queue(request); !queued) return tl::unexpected(queued.error());
      if (frame) return CameraEvent{CameraEvent::Kind::frame, std::move(*frame)};
    }
  }

  void lock(std::chrono::milliseconds patience) override {
    lock_ = CameraLock::settling;
    patience_ = patience;
    asked_.reset();
    settle_.restart();
  }

  void unlock() override {
    if (lock_ == CameraLock::held && opened_) {
      lc::ControlList controls(camera().controls());
      shim::free_exposure(controls, camera().controls());
      set(controls, ids::AwbEnable, true);
      set(controls, ids::AfMode, static_cast<std::int32_t>(ids::AfModeContinuous));
      next_controls_ = controls;
    }
    held_.reset();
    lock_ = CameraLock::automatic;
  }

  CameraLock locked() const override { return lock_; }
  std::optional<double> clock_offset() const override { return clock_.offset(); }

  CameraCounters counters() const override {
    CameraCounters counters = opened_ ? opened_->arrivals.counters() : counters_;
    if (opened_) {
      counters.torn = counters_.torn;
      counters.missed = counters_.missed;
    }
    return counters;
  }

 private:
  lc::Camera& camera() const { return *opened_->camera; }
  const lc::StreamConfiguration& main() const { return opened_->configuration->at(0); }
  bool has_two() const { return opened_->configuration->size() > 1; }

  // One or two streams in one configuration that libcamera has validated.
  Result<void> configure(const CameraName& name) {
    lc::Size wanted(static_cast<unsigned>(name.width), static_cast<unsigned>(name.height));
    for (const bool two : {true, false}) {
      std::vector<lc::StreamRole> roles = {lc::StreamRole::VideoRecording};
      if (two) roles.push_back(lc::StreamRole::Viewfinder);
      opened_->configuration = camera().generateConfiguration(roles);
      if (!opened_->configuration || opened_->configuration->size() != roles.size()) continue;
      lc::StreamConfiguration& main_stream = opened_->configuration->at(0);
      if (wanted.isNull()) wanted = main_stream.size;
      if (!choose_format(main_stream, wanted, two)) continue;
      main_stream.bufferCount = static_cast<unsigned>(name.buffers);
      if (two) {
        lc::StreamConfiguration& small = opened_->configuration->at(1);
        const unsigned longer = std::max(wanted.width, wanted.height);
        const auto reduced = [&](unsigned side) { return side * analysis_side / longer / 2 * 2; };
        if (!choose_format(small, lc::Size(reduced(wanted.width), reduced(wanted.height)), true)) continue;
        small.bufferCount = main_stream.bufferCount;
      }
      const std::string asked = text_of(*opened_->configuration);
      const lc::CameraConfiguration::Status status = opened_->configuration->validate();
      if (status == lc::CameraConfiguration::Invalid || opened_->configuration->size() != roles.size()) continue;
      if (!readable(main().pixelFormat) || (two && !readable(opened_->configuration->at(1).pixelFormat))) continue;
      spdlog::info("{}: {}", camera().id(), text_of(*opened_->configuration));
      if (status == lc::CameraConfiguration::Adjusted) spdlog::warn("{}: {} was asked for", camera().id(), asked);
      if (const int error = camera().configure(opened_->configuration.get()); error != 0)
        return fail("the camera refuses its configuration",
                    camera().id() + ", " + text_of(*opened_->configuration) + " (" + std::strerror(-error) + ")");
      return {};
    }
    return fail("the camera has no picture format that can be read", camera().id());
  }

  static std::string text_of(const lc::CameraConfiguration& configuration) {
    std::string text;
    for (const lc::StreamConfiguration& stream : configuration) {
      if (!text.empty()) text += " and ";
      text += stream.toString() + ", " + std::to_string(stream.bufferCount) + " buffers";
    }
    return text;
  }

  Result<void> allocate() {
    opened_->allocator = std::make_unique<lc::FrameBufferAllocator>(opened_->camera);
    std::size_t count = main().bufferCount;
    for (const lc::StreamConfiguration& stream : *opened_->configuration) {
      if (opened_->allocator->allocate(stream.stream()) < 0) return fail("no memory for pictures", camera().id());
      count = std::min(count, opened_->allocator->buffers(stream.stream()).size());
    }
    for (std::size_t i = 0; i < count; ++i) {
      std::unique_ptr<lc::Request> request = camera().createRequest(i);
      if (!request) return fail("no requests for pictures", camera().id());
      for (const lc::StreamConfiguration& stream : *opened_->configuration) {
        const std::unique_ptr<lc::FrameBuffer>& buffer = opened_->allocator->buffers(stream.stream())[i];
        if (request->addBuffer(stream.stream(), buffer.get()) != 0)
          return fail("a buffer for pictures is refused", camera().id());
        auto mapped = std::make_unique<MappedBuffer>(*buffer);
        if (!mapped->whole()) return fail("buffers of the camera cannot be read", camera().id());
        opened_->buffers[buffer.get()] = std::move(mapped);
      }
      opened_->requests.push_back(std::move(request));
    }
    opened_->arrivals.expect(opened_->requests.size());
    return {};
  }

  double fps() const {
    constexpr double usual = 30.0;
    constexpr double microseconds = 1e-6;
    const auto limits = camera().controls().find(&ids::FrameDurationLimits);
    if (limits == camera().controls().end()) return usual;
    const auto shortest = limits->second.min().get<std::int64_t>();
    return shortest > 0 ? 1.0 / (microseconds * static_cast<double>(shortest)) : usual;
  }

  Result<void> queue(lc::Request& request) {
    opened_->arrivals.queued(request.cookie());
    const int error = camera().queueRequest(&request);
    if (error == 0) return {};
    opened_->arrivals.refused(request.cookie());
    return fail("the camera takes no request", info_.name + " (" + std::strerror(-error) + ")");
  }

  // The frame of a request; nothing when it is damaged or has no room.
  std::optional<Frame> take(lc::Request& request) {
    constexpr double nanoseconds = 1e-9;
    const lc::FrameBuffer& buffer = *request.findBuffer(main().stream());
    const lc::FrameMetadata& metadata = buffer.metadata();
    if (last_sequence_ && metadata.sequence > *last_sequence_ + 1)
      counters_.missed += metadata.sequence - *last_sequence_ - 1;
    last_sequence_ = metadata.sequence;
    const double stamp = nanoseconds * static_cast<double>(metadata.timestamp);
    if (metadata.timestamp != 0) clock_.add(stamp, monotonic_now(), boot_now());
    std::optional<Frame> frame;
    if (metadata.status == lc::FrameMetadata::FrameSuccess) frame = read(request, buffer);
    if (!frame) {
      ++counters_.torn;
      return frame;
    }
    if (frame->jpeg.empty() && !frame->full) {
      ++counters_.missed;
      return std::nullopt;
    }
    if (!first_stamp_) first_stamp_ = stamp;
    frame->index = count_++;
    frame->time = stamp - *first_stamp_;
    frame->settings = settings_of(request.metadata());
    return frame;
  }

  std::optional<Frame> read(lc::Request& request, const lc::FrameBuffer& buffer) {
    Frame frame;
    const Readable& how = *readable(main().pixelFormat);
    const MappedBuffer& mapped = *opened_->buffers.at(&buffer);
    mapped.begin_read();
    RawPicture raw;
    if (how.raw) {
      raw = copy_raw(mapped, main(), *how.raw);
    } else {
      const std::span<const std::uint8_t> plane = mapped.planes().front();
      const std::size_t used = std::min<std::size_t>(plane.size(), buffer.metadata().planes()[0].bytesused);
      frame.jpeg.assign(plane.begin(), plane.begin() + static_cast<std::ptrdiff_t>(used));
    }
    mapped.end_read();
    if (!how.raw) {
      Result<cv::Mat> image = decode_jpeg(frame.jpeg, analysis_side);
      if (!image) return std::nullopt;
      frame.image = std::move(*image);
      return frame;
    }
    if (raw.bytes.size() != raw_bytes(raw.format, raw.width, raw.height)) return std::nullopt;
    if (has_two()) {
      const lc::StreamConfiguration& small = opened_->configuration->at(1);
      const MappedBuffer& analysis = *opened_->buffers.at(request.findBuffer(small.stream()));
      analysis.begin_read();
      const RawPicture reduced = copy_raw(analysis, small, *readable(small.pixelFormat)->raw);
      analysis.end_read();
      if (reduced.bytes.size() != raw_bytes(reduced.format, reduced.width, reduced.height)) return std::nullopt;
      frame.image = reduced_bgr(reduced, analysis_side);
    } else {
      frame.image = reduced_bgr(raw, analysis_side);
    }
    frame.full = pool_.keep(std::move(raw));
    return frame;
  }

  static FrameSettings settings_of(const lc::ControlList& metadata) {
    constexpr double microseconds = 1e-6;
    FrameSettings settings;
    if (const auto exposure = metadata.get(ids::ExposureTime)) settings.exposure_s = microseconds * *exposure;
    if (const auto gain = metadata.get(ids::AnalogueGain)) settings.gain = *gain;
    if (const auto lens = metadata.get(ids::LensPosition)) settings.lens_position = *lens;
    return settings;
  }

  template <class T>
  void set(lc::ControlList& controls, const lc::Control<T>& control, const T& value) const {
    if (camera().controls().count(&control) != 0) controls.set(control, value);
  }

  void hold_when_settled(const Frame& frame, const lc::ControlList& metadata) {
    if (lock_ != CameraLock::settling) return;
    constexpr double milliseconds = 1e-3;
    if (!asked_) asked_ = frame.time;
    const cv::Scalar mean = cv::mean(frame.image);
    const bool rests = settle_.add(frame.time, (mean[0] + mean[1] + mean[2]) / 3.0);
    // The camera knows best; not all say.
    const bool exposed = shim::exposure_settled(metadata).value_or(rests);
    const auto focus = metadata.get(ids::AfState);
    const bool focused = !focus || *focus == ids::AfStateFocused || *focus == ids::AfStateIdle;
    const bool late = frame.time - *asked_ >= milliseconds * static_cast<double>(patience_.count());
    if (!(exposed && focused) && !late) return;
    if (!(exposed && focused)) spdlog::warn("{}: exposure or focus do not settle, held as they are", info_.name);
    hold(metadata);
  }

  // Everything as the automatics left it in the frame of this metadata.
  void hold(const lc::ControlList& metadata) {
    lc::ControlList controls(camera().controls());
    shim::hold_exposure(controls, camera().controls(), metadata.get(ids::ExposureTime),
                        metadata.get(ids::AnalogueGain));
    set(controls, ids::AwbEnable, false);
    if (const auto gains = metadata.get(ids::ColourGains); gains && camera().controls().count(&ids::ColourGains) != 0)
      controls.set(ids::ColourGains, *gains);
    set(controls, ids::AfMode, static_cast<std::int32_t>(ids::AfModeManual));
    if (const auto lens = metadata.get(ids::LensPosition)) set(controls, ids::LensPosition, *lens);
    held_ = controls;
    next_controls_ = controls;
    lock_ = CameraLock::held;
    const FrameSettings settings = settings_of(metadata);
    spdlog::info("{}: held, exposure {} s, gain {}", info_.name, settings.exposure_s.value_or(0.0),
                 settings.gain.value_or(0.0));
  }

  std::unique_ptr<Opened> opened_;  // none when the device went while it streamed
  CameraInfo info_;
  EncodePool pool_;
  CameraCounters counters_;  // what is not counted where requests arrive

  bool started_ = false;
  int count_ = 0;
  std::optional<double> first_stamp_;
  std::optional<std::uint32_t> last_sequence_;
  SensorClock clock_;

  CameraLock lock_ = CameraLock::automatic;
  SettleWatch settle_;
  std::chrono::milliseconds patience_{};
  std::optional<double> asked_;                   // frame time of the first frame after lock()
  std::optional<lc::ControlList> held_;           // also for the next start
  std::optional<lc::ControlList> next_controls_;  // for the next request
};

}  // namespace

Result<std::unique_ptr<CameraDevice>> open_libcamera(const CameraName& name) {
  const Result<std::shared_ptr<lc::CameraManager>> keeper = manager();
  if (!keeper) return tl::unexpected(keeper.error());
  const std::vector<std::shared_ptr<lc::Camera>> cameras = (*keeper)->cameras();
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const std::shared_ptr<lc::Camera>& camera) {
    return name.target.empty() || camera->id() == name.target;
  });
  if (found == cameras.end()) {
    std::string there;
    for (const auto& camera : cameras) there += (there.empty() ? "there are: " : ", ") + camera->id();
    return fail("no camera there", "libcamera:" + name.target, there.empty() ? "check that it is connected" : there);
  }
  auto camera = std::make_unique<LibcameraCamera>(*keeper, *found);
  if (const Result<void> opened = camera->open(name); !opened) return tl::unexpected(opened.error());
  return camera;
}

}  // namespace gyre
