// SPDX-License-Identifier: Apache-2.0
#include "device/camera/libcamera_opened.h"

#include <libcamera/property_ids.h>
#include <libcamera/request.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <algorithm>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>

namespace gyre {

namespace lc = libcamera;

Result<std::shared_ptr<lc::CameraManager>> camera_manager() {
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

OpenedLibcamera::OpenedLibcamera(std::shared_ptr<lc::CameraManager> manager, std::shared_ptr<lc::Camera> found)
    : keeper(std::move(manager)), camera(std::move(found)) {}

OpenedLibcamera::~OpenedLibcamera() {
  if (!acquired) return;
  camera->requestCompleted.disconnect(&arrivals);
  camera->disconnected.disconnect(&arrivals);
  requests.clear();
  buffers.clear();
  allocator.reset();
  configuration.reset();
  camera->release();
}

Result<void> OpenedLibcamera::acquire() {
  if (const int error = camera->acquire(); error != 0)
    return fail("the camera cannot be had", camera->id() + " (" + std::strerror(-error) + ")",
                "end the other program that uses it");
  acquired = true;
  camera->requestCompleted.connect(&arrivals, &Arrivals::completed);
  camera->disconnected.connect(&arrivals, &Arrivals::disconnected);
  return {};
}

Result<void> OpenedLibcamera::allocate() {
  allocator = std::make_unique<lc::FrameBufferAllocator>(camera);
  std::size_t count = configuration->at(0).bufferCount;
  for (const lc::StreamConfiguration& stream : *configuration) {
    if (allocator->allocate(stream.stream()) < 0) return fail("no memory for pictures", camera->id());
    count = std::min(count, allocator->buffers(stream.stream()).size());
  }
  for (std::size_t i = 0; i < count; ++i) {
    std::unique_ptr<lc::Request> request = camera->createRequest(i);
    if (!request) return fail("no requests for pictures", camera->id());
    for (const lc::StreamConfiguration& stream : *configuration) {
      const std::unique_ptr<lc::FrameBuffer>& buffer = allocator->buffers(stream.stream())[i];
      if (request->addBuffer(stream.stream(), buffer.get()) != 0)
        return fail("a buffer for pictures is refused", camera->id());
      auto mapped = std::make_unique<MappedBuffer>(*buffer);
      if (!mapped->whole()) return fail("buffers of the camera cannot be read", camera->id());
      buffers[buffer.get()] = std::move(mapped);
    }
    requests.push_back(std::move(request));
  }
  arrivals.expect(requests.size());
  return {};
}

bool OpenedLibcamera::gone() const {
  if (arrivals.gone()) return true;
  const auto devices = camera->properties().get(lc::properties::SystemDevices);
  if (!devices) return false;
  return std::any_of(devices->begin(), devices->end(), [](std::int64_t device) {
    const auto number = static_cast<dev_t>(device);
    const std::string node = std::to_string(major(number)) + ":" + std::to_string(minor(number));
    return ::access(("/sys/dev/char/" + node).c_str(), F_OK) != 0;
  });
}

void abandon(std::unique_ptr<OpenedLibcamera> opened) {
  static auto* const abandoned = new std::vector<std::unique_ptr<OpenedLibcamera>>;
  opened->arrivals.write_off();
  abandoned->push_back(std::move(opened));
}

}  // namespace gyre
